// `knuckle doctor`: what this computer and a machine bus can do, and what is missing. Reads only.
#pragma once

#include "app/cli/command.h"

namespace knuckle::bringup {

/// Exit codes: 0 nothing is wrong; 1 something is; 2 wrong usage, or the bus cannot be opened.
[[nodiscard]] cli::Command doctor_entry();

}  // namespace knuckle::bringup
