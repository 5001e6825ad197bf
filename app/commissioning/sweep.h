// The command `knuckle sweep --battery estimation`: many drawn machines, each commissioned, identified and judged.
#pragma once

#include "app/command.h"

namespace knuckle::app {

[[nodiscard]] Command sweep_entry();

}  // namespace knuckle::app
