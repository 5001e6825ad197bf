// A CAN bus whose frames are copied for a log as they pass, both ways, without ever waiting for who writes the log.
#pragma once

#include <atomic>
#include <cstdint>
#include <ostream>
#include <string>

#include "core/ring.h"
#include "core/time.h"
#include "transport/can_bus.h"
#include "transport/timed_frame.h"

namespace knuckle::programs {

class RecordedCan final : public CanBus {
 public:
  /// @param bus outlives this. @param recording false: frames only pass.
  RecordedCan(CanBus& bus, bool recording) noexcept : bus_(bus), recording_(recording) {}

  // For the thread of the loop.
  /// Time that frames get from now on: of the step that sends or takes them.
  void stamp(Time now) noexcept { now_ = now; }
  bool send(const CanFrame& frame) noexcept override {
    const bool sent = bus_.send(frame);
    if (sent) keep(frame);
    return sent;
  }
  bool receive(CanFrame& frame) noexcept override {
    const bool received = bus_.receive(frame);
    if (received) keep(frame);
    return received;
  }
  [[nodiscard]] CanState state() const noexcept override { return bus_.state(); }
  void acknowledge() noexcept override { bus_.acknowledge(); }
  [[nodiscard]] std::uint64_t errors() const noexcept override { return bus_.errors(); }

  // For the thread that writes.
  /// Lines of a candump log for what has passed since the last call.
  void write(std::ostream& out, const std::string& interface);
  /// Frames that passed without room for a copy; any thread.
  [[nodiscard]] std::uint64_t lost() const noexcept { return passed_.dropped(); }

 private:
  void keep(const CanFrame& frame) noexcept {
    if (recording_) passed_.push({now_, frame});
  }

  CanBus& bus_;
  bool recording_;
  Time now_{};
  Ring<TimedFrame, 8192> passed_;  // about a second of a full bus at 1 Mbit/s
};

}  // namespace knuckle::programs
