// `knuckle commission`: a machine's first motions, step by step at a terminal.
#pragma once

#include "app/command.h"

namespace knuckle::app {

/// Exit codes: 0 it came to its end and the result is written; 1 it ended before, nothing is written; 2 wrong usage.
[[nodiscard]] Command commission_entry();

}  // namespace knuckle::app
