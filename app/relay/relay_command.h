// `knuckle relay`: options, run, result.
#pragma once

#include "app/cli/command.h"

namespace knuckle::relay {

[[nodiscard]] cli::Command relay_entry();

}  // namespace knuckle::relay
