// `knuckle doctor`: what this computer and a machine bus can do, and what is missing. Reads only.
#pragma once

#include "app/command.h"

namespace knuckle::app {

/// Exit codes: 0 nothing is wrong; 1 something is; 2 wrong usage, or the bus cannot be opened.
[[nodiscard]] Command doctor_entry();

}  // namespace knuckle::app
