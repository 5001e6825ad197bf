// `knuckle doctor`: checks this computer, a machine bus or a haptic device. Reads only.
#pragma once

#include "app/cli/command.h"

namespace knuckle::bringup {

/// Exit codes: 0 no fault; 1 a fault; 2 wrong usage, or the bus cannot be opened.
[[nodiscard]] cli::Command doctor_entry();

}  // namespace knuckle::bringup
