// `knuckle device`: the simulated firmware and hand on a USB gadget.
#pragma once

#include "app/command.h"

namespace knuckle::app {

/// Exit codes: 0 ended when told to, or the operator has finished; 1 the operator has given up, or was ended before;
/// 2 wrong usage.
[[nodiscard]] Command device_entry();

}  // namespace knuckle::app
