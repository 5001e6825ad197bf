// A device's cable that notes what the device is told.
#pragma once

#include "transport/hid_port.h"
#include "transport/hid_reports.h"

namespace knuckle::test {

class Overheard final : public HidPort {
 public:
  /// @param port outlives this.
  explicit Overheard(HidPort& port) : port_(port) {}
  bool write(const HidReport& report) noexcept override {
    if (const auto command = decode_command(report)) told = *command;
    return port_.write(report);
  }
  bool read(HidReport& report) noexcept override { return port_.read(report); }
  [[nodiscard]] bool connected() const noexcept override { return port_.connected(); }
  DeviceCommand told;

 private:
  HidPort& port_;
};

}  // namespace knuckle::test
