// `knuckle master`: the operator's side with a haptic device, without a screen.
#pragma once

#include "app/command.h"

namespace knuckle::app {

/// Exit codes: 0 it was told to end, or its time was over.
[[nodiscard]] Command master_entry();

}  // namespace knuckle::app
