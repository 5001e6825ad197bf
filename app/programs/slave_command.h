// `knuckle slave`: the machine's side on a CAN interface.
#pragma once

#include "app/cli/command.h"

namespace knuckle::programs {

/// Exit codes: 0 it was interrupted, or its duration has passed.
[[nodiscard]] cli::Command slave_entry();

}  // namespace knuckle::programs
