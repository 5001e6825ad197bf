// A CAN bus whose frames are counted by their bits as they pass, both ways: how much of it the controller's own traffic
// takes.
#pragma once

#include <cstdint>

#include "core/time.h"
#include "transport/can_bus.h"
#include "transport/can_load.h"

namespace knuckle {

/// Frames that the controller's filter keeps out are not counted: on a CAN interface, those of a stranger who babbles.
class MeteredCan final : public CanBus {
 public:
  /// @param bus outlives this.
  MeteredCan(CanBus& bus, std::uint32_t bit_rate) noexcept : bus_(bus), bit_rate_(bit_rate) {}

  bool send(const CanFrame& frame) noexcept override {
    const bool sent = bus_.send(frame);
    if (sent) bits_ += frame_bits(frame);
    return sent;
  }
  bool receive(CanFrame& frame) noexcept override {
    const bool received = bus_.receive(frame);
    if (received) bits_ += frame_bits(frame);
    return received;
  }
  [[nodiscard]] CanState state() const noexcept override { return bus_.state(); }
  void acknowledge() noexcept override { bus_.acknowledge(); }
  [[nodiscard]] std::uint64_t errors() const noexcept override { return bus_.errors(); }

  /// Share of the bus' time that the frames since the last call took; 0 at the first call.
  [[nodiscard]] double take_load(Time now) noexcept {
    const double share = since_ == kNever || now <= since_
                             ? 0
                             : static_cast<double>(bits_) / (to_seconds(now - since_) * static_cast<double>(bit_rate_));
    since_ = now;
    bits_ = 0;
    return share;
  }

 private:
  CanBus& bus_;
  std::uint32_t bit_rate_;
  Time since_ = kNever;
  std::uint64_t bits_ = 0;
};

}  // namespace knuckle
