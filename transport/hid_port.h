// The haptic device's wire: 64-byte numbered HID reports, the report number in byte 0. Both the driver's end and
// the firmware's end of a cable are HidPorts.
#pragma once

#include <array>
#include <cstdint>

namespace knuckle {

using HidReport = std::array<std::uint8_t, 64>;

class HidPort {
 public:
  virtual ~HidPort() = default;
  /// Queues a report; never blocks. False where the device is gone or the queue is full.
  virtual bool write(const HidReport& report) noexcept = 0;
  /// The next report from the other end, oldest first; false where there is none. Never blocks.
  virtual bool read(HidReport& report) noexcept = 0;
  [[nodiscard]] virtual bool connected() const noexcept = 0;
};

}  // namespace knuckle
