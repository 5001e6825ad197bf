// A CAN frame with the time at which it passed.
#pragma once

#include "core/time.h"
#include "transport/can_bus.h"

namespace knuckle {

struct TimedFrame {
  Time at{};
  CanFrame frame;
};

}  // namespace knuckle
