// A CAN bus whose frames are watched as they pass, both ways, without ever waiting: how much of the bus' time the
// controller's own traffic takes, and copies of them for a log.
#pragma once

#include <cstdint>
#include <memory>
#include <ostream>
#include <string>

#include "core/ring.h"
#include "core/time.h"
#include "transport/can_bus.h"
#include "transport/can_load.h"
#include "transport/timed_frame.h"

namespace knuckle {

/// Frames that the controller's filter keeps out are not seen: on a CAN interface, those of a stranger who babbles.
class WatchedCan final : public CanBus {
 public:
  /// @param bus outlives this. @param recording whether copies are kept for write(). Allocates their room.
  WatchedCan(CanBus& bus, std::uint32_t bit_rate, bool recording = false);

  // For the thread of the loop.
  /// Time that copies get from now on: of the step that sends or takes the frames.
  void stamp(Time now) noexcept { now_ = now; }
  bool send(const CanFrame& frame) noexcept override {
    const bool sent = bus_.send(frame);
    if (sent) note(frame);
    return sent;
  }
  bool receive(CanFrame& frame) noexcept override {
    const bool received = bus_.receive(frame);
    if (received) note(frame);
    return received;
  }
  [[nodiscard]] CanState state() const noexcept override { return bus_.state(); }
  void acknowledge() noexcept override { bus_.acknowledge(); }
  [[nodiscard]] std::uint64_t errors() const noexcept override { return bus_.errors(); }
  /// Share of the bus' time that the frames since the last call took; 0 at the first call.
  [[nodiscard]] double take_load(Time now) noexcept;

  // For the thread that writes.
  /// Lines of a candump log for what has passed since the last call.
  void write(std::ostream& out, const std::string& interface);
  /// Frames that passed without room for a copy; any thread.
  [[nodiscard]] std::uint64_t lost() const noexcept { return copies_ ? copies_->dropped() : 0; }

 private:
  using Copies = Ring<TimedFrame, 8192>;  // about a second of a full bus at 1 Mbit/s
  void note(const CanFrame& frame) noexcept {
    bits_ += frame_bits(frame);
    if (copies_) copies_->push({now_, frame});
  }

  CanBus& bus_;
  std::uint32_t bit_rate_;
  std::unique_ptr<Copies> copies_;
  Time now_{}, since_ = kNever;
  std::uint64_t bits_ = 0;
};

}  // namespace knuckle
