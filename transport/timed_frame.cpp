#include "transport/timed_frame.h"

#include <fmt/format.h>

namespace knuckle {

std::string candump_line(Time at, const CanFrame& frame, const char* interface, const char* second) {
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(at.time_since_epoch()).count();
  const bool extended = (frame.id & kExtendedId) != 0;
  std::string line =
      fmt::format("({:010}.{:06}) {:.16} {:0{}X}#", us / 1000000, us % 1000000,
                  (frame.id & kSecondBus) != 0 ? second : interface, frame.id & kMostExtendedId, extended ? 8 : 3);
  for (std::size_t i = 0; i < frame.size; ++i) line += fmt::format("{:02X}", frame.data[i]);
  return line;
}

}  // namespace knuckle
