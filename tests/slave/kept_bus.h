// A bus that keeps what is sent, and can be full or gone.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <vector>

#include "transport/can_bus.h"

namespace knuckle::test {

class KeptBus final : public CanBus {
 public:
  bool send(const CanFrame& frame) noexcept override {
    if (full) return false;
    sent.push_back(frame);
    return true;
  }
  bool receive(CanFrame& /*frame*/) noexcept override { return false; }
  [[nodiscard]] CanState state() const noexcept override { return state_now; }
  [[nodiscard]] std::array<CanState, 2> states() const noexcept override {
    std::array<CanState, 2> both{};
    both.at(of_bus) = state_now;
    return both;
  }
  [[nodiscard]] std::vector<CanFrame> frames(std::uint32_t id) const {
    std::vector<CanFrame> found;
    std::copy_if(sent.begin(), sent.end(), std::back_inserter(found), [id](const auto& f) { return f.id == id; });
    return found;
  }
  std::vector<CanFrame> sent;
  bool full = false;
  CanState state_now = CanState::kActive;
  std::uint8_t of_bus = 0;  ///< Which of two buses is in that state.
};

}  // namespace knuckle::test
