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
    const CanState first = buses_[0]->state(), second = buses_[1] != nullptr ? buses_[1]->state() : CanState::kActive;
    of_ = second > first ? 1 : 0;
    return std::max(first, second);
  }
  [[nodiscard]] std::uint8_t state_of() const noexcept override { return of_; }
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
  mutable std::uint8_t of_ = 0;
};

}  // namespace knuckle
