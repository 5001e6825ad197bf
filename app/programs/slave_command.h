// `knuckle slave`: the machine's side on a CAN interface.
#pragma once

#include "app/cli/command.h"

namespace knuckle::programs {

/// Exit codes: 0 it was told to end, or its time was over.
[[nodiscard]] cli::Command slave_entry();

}  // namespace knuckle::programs
