// `knuckle audit`: prints an audit trail, and whether it is as it was written.
#pragma once

#include "app/cli/command.h"

namespace knuckle::audit {

/// Exit codes: 0 the chain is whole, 1 it is broken.
[[nodiscard]] cli::Command audit_entry();

}  // namespace knuckle::audit
