// Two CAN buses as one, for a loop that has one.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "transport/can_bus.h"

namespace knuckle {

/// Frames go to the bus that their identifiers name, and arrive with it in them.
class CanBuses final : public CanBus {
 public:
  /// @param second null: there is one. All outlive this.
  explicit CanBuses(CanBus& first, CanBus* second = nullptr) noexcept : buses_{&first, second} {}

  bool send(const CanFrame& frame) noexcept override {
    CanFrame plain = frame;
    plain.id &= ~kSecondBus;
    CanBus* const bus = buses_[(frame.id & kSecondBus) != 0 ? 1 : 0];
    return bus != nullptr && bus->send(plain);
  }
  /// In turns: what floods one of them leaves the other's frames their share of a step.
  bool receive(CanFrame& frame) noexcept override {
    for (int tries = 0; tries < 2; ++tries) {
      turn_ = 1 - turn_;
      if (buses_[turn_] == nullptr || !buses_[turn_]->receive(frame)) continue;
      if (turn_ == 1) frame.id |= kSecondBus;
      return true;
    }
    return false;
  }
  [[nodiscard]] CanState state() const noexcept override {
    found_ = {buses_[0]->state(), buses_[1] != nullptr ? buses_[1]->state() : CanState::kActive};
    return std::max(found_[0], found_[1]);
  }
  [[nodiscard]] std::array<CanState, 2> states() const noexcept override { return found_; }
  void acknowledge() noexcept override {
    for (CanBus* const bus : buses_)
      if (bus != nullptr) bus->acknowledge();
  }
  [[nodiscard]] std::uint64_t errors() const noexcept override {
    return buses_[0]->errors() + (buses_[1] != nullptr ? buses_[1]->errors() : 0);
  }

 private:
  std::array<CanBus*, 2> buses_;
  std::size_t turn_ = 1;
  mutable std::array<CanState, 2> found_{};
};

/// One of two buses that are one for others, as if there were no other: what comes on the other meanwhile is nobody's.
class OneOfBuses final : public CanBus {
 public:
  /// @param both outlives this. @param which 0 or 1
  OneOfBuses(CanBus& both, std::size_t which) noexcept : both_(both), on_(which == 0 ? 0 : kSecondBus) {}

  bool send(const CanFrame& frame) noexcept override {
    CanFrame marked = frame;
    marked.id |= on_;
    return both_.send(marked);
  }
  bool receive(CanFrame& frame) noexcept override {
    while (both_.receive(frame)) {
      if ((frame.id & kSecondBus) != on_) continue;
      frame.id &= ~kSecondBus;
      return true;
    }
    return false;
  }
  /// Its own.
  [[nodiscard]] CanState state() const noexcept override {
    (void)both_.state();
    return both_.states()[on_ != 0 ? 1 : 0];
  }
  /// Of both.
  [[nodiscard]] std::uint64_t errors() const noexcept override { return both_.errors(); }

 private:
  CanBus& both_;
  std::uint32_t on_;
};

}  // namespace knuckle
