// `knuckle master`: the operator's side with a haptic device, without a screen.
#pragma once

#include "app/cli/command.h"

namespace knuckle::programs {

/// Exit codes: 0 it was told to end, or its time was over.
[[nodiscard]] cli::Command master_entry();

}  // namespace knuckle::programs
