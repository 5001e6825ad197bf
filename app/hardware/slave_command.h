// `knuckle slave`: the machine's side on a CAN interface.
#pragma once

#include "app/command.h"

namespace knuckle::app {

/// Exit codes: 0 it was told to end, or its time was over.
[[nodiscard]] Command slave_entry();

}  // namespace knuckle::app
