// `knuckle commission`: a machine's first motions, step by step at a terminal.
#pragma once

#include "app/cli/command.h"

namespace knuckle::bringup {

/// Exit codes: 0 it came to its end and the result is written; 1 it ended before, nothing is written; 2 wrong usage.
[[nodiscard]] cli::Command commission_entry();

}  // namespace knuckle::bringup
