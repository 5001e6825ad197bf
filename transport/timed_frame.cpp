#include "transport/timed_frame.h"

#include <array>
#include <cstdio>

namespace knuckle {

std::string candump_line(Time at, const CanFrame& frame, const char* interface) {
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(at.time_since_epoch()).count();
  std::array<char, 80> text{};
  int length =
      std::snprintf(text.data(), text.size(), "(%010lld.%06lld) %.16s %03X#", static_cast<long long>(us / 1000000),
                    static_cast<long long>(us % 1000000), interface, static_cast<unsigned>(frame.id));
  for (std::size_t i = 0; i < frame.size; ++i) {
    const auto used = static_cast<std::size_t>(length);
    length += std::snprintf(text.data() + used, text.size() - used, "%02X", unsigned{frame.data[i]});
  }
  return text.data();
}

}  // namespace knuckle
