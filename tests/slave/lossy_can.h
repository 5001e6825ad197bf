// A controller's end of a bus on which frames get lost.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "transport/can_bus.h"

namespace knuckle::test {

/// Frames with the identifiers `lost` get lost, both ways.
class LossyCan final : public CanBus {
 public:
  explicit LossyCan(CanBus& bus) noexcept : bus_(bus) {}
  bool send(const CanFrame& frame) noexcept override { return is_lost(frame) || bus_.send(frame); }
  bool receive(CanFrame& frame) noexcept override {
    while (bus_.receive(frame))
      if (!is_lost(frame)) return true;
    return false;
  }
  [[nodiscard]] CanState state() const noexcept override { return bus_.state(); }
  [[nodiscard]] std::array<CanState, 2> states() const noexcept override { return bus_.states(); }
  void acknowledge() noexcept override { bus_.acknowledge(); }
  std::vector<std::uint32_t> lost;

 private:
  [[nodiscard]] bool is_lost(const CanFrame& frame) const noexcept {
    return std::find(lost.begin(), lost.end(), frame.id) != lost.end();
  }
  CanBus& bus_;
};

}  // namespace knuckle::test
