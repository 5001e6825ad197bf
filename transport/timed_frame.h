// A CAN frame with the time at which it passed.
#pragma once

#include <string>

#include "core/time.h"
#include "transport/can_bus.h"

namespace knuckle {

struct TimedFrame {
  Time at{};
  CanFrame frame;
};

/// One line of a candump log without newline: "(0000000012.345678) can0 185#0011223344556677". Allocates.
/// @param second interface of the second of two buses
[[nodiscard]] std::string candump_line(Time at, const CanFrame& frame, const char* interface = "can0",
                                       const char* second = "can1");

}  // namespace knuckle
