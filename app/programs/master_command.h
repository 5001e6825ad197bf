// `knuckle master`: the operator's side with a haptic device, without a screen.
#pragma once

#include "app/cli/command.h"

namespace knuckle::programs {

/// Exit codes: 0 it was interrupted, or its duration has passed.
[[nodiscard]] cli::Command master_entry();

}  // namespace knuckle::programs
