// The operator's wires with a gate on each: whoever tends the master loop can let go of device and machine, whatever
// the loop itself goes on asking for.
#pragma once

#include <optional>
#include <span>

#include "transport/hid_port.h"
#include "transport/hid_reports.h"
#include "transport/link.h"
#include "transport/link_messages.h"

namespace knuckle::programs {

/// Steps of one millisecond that an end takes: some of the datagrams that say so arrive.
inline constexpr int kLettingGoSteps = 100;

/// The device's wire; once let go, every command on it says "off" instead of what the loop asked for.
class LettingGoPort final : public HidPort {
 public:
  /// @param port outlives this.
  explicit LettingGoPort(HidPort& port) noexcept : port_(port) {}
  void let_go() noexcept { let_go_ = true; }
  bool write(const HidReport& report) noexcept override {
    auto command = let_go_ ? decode_command(report) : std::nullopt;
    if (!command) return port_.write(report);
    command->mode = TorqueMode::kOff;
    command->torque_permille = {};
    return port_.write(encode(*command));
  }
  bool read(HidReport& report) noexcept override { return port_.read(report); }
  [[nodiscard]] bool connected() const noexcept override { return port_.connected(); }

 private:
  HidPort& port_;
  bool let_go_ = false;
};

/// The link; while let go, every message on it says that nobody holds the device.
class LettingGoLink final : public Link {
 public:
  /// @param link outlives this.
  explicit LettingGoLink(Link& link) noexcept : link_(link) {}
  void let_go(bool on = true) noexcept { let_go_ = on; }
  bool send(std::span<const std::uint8_t> bytes) noexcept override {
    auto message = let_go_ ? decode_master(bytes) : std::nullopt;
    if (!message) return link_.send(bytes);
    message->presence = message->enable = message->clutch = false;
    return link_.send(encode(*message).view());
  }
  bool receive(Datagram& datagram) noexcept override { return link_.receive(datagram); }

 private:
  Link& link_;
  bool let_go_ = false;
};

}  // namespace knuckle::programs
