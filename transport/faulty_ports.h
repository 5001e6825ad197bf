// The wire of the simulated machine, with what can be done to it: it loses, swallows and doubles.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>

#include "core/ring.h"
#include "transport/can_bus.h"

namespace knuckle {

/// The nodes' end of the machine's bus.
class FaultyPort final : public CanBus {
 public:
  explicit FaultyPort(CanBus& bus) noexcept : bus_(bus) {}
  bool send(const CanFrame& frame) noexcept override;
  bool receive(CanFrame& frame) noexcept override;
  [[nodiscard]] CanState state() const noexcept override { return bus_.state(); }
  [[nodiscard]] std::array<CanState, 2> states() const noexcept override { return bus_.states(); }
  void acknowledge() noexcept override { bus_.acknowledge(); }
  [[nodiscard]] std::uint64_t errors() const noexcept override { return bus_.errors(); }

  /// @param bus 0 or 1
  void cut(bool on, std::size_t bus = 0) noexcept { cut_[bus] = on; }
  void drop_sync(bool on) noexcept { drop_sync_ = on; }
  /// What the node of this id sends is sent twice, as if a second device had its id.
  void double_node(std::uint8_t id, bool on) noexcept { doubled_[id & 0x7FU] = on; }
  /// Only the nodes on this port hear it, before anything else. As many between two steps as there are node ids.
  void whisper(const CanFrame& frame) noexcept { whispered_.push(frame); }
  /// Past everything else, onto the bus.
  bool shout(const CanFrame& frame) noexcept { return bus_.send(frame); }

 private:
  [[nodiscard]] bool cut_off(const CanFrame& frame) const noexcept {
    return cut_[(frame.id & kSecondBus) != 0 ? 1 : 0];
  }
  CanBus& bus_;
  std::array<bool, 2> cut_{};
  bool drop_sync_ = false;
  std::bitset<128> doubled_;
  Ring<CanFrame, 128> whispered_;
};

}  // namespace knuckle
