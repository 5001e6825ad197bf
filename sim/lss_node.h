// A simulated device's side of LSS (CiA 305): how it is given its node id.
#pragma once

#include <cstdint>

#include "transport/can_bus.h"
#include "transport/lss.h"

namespace knuckle::sim {

class LssNode {
 public:
  struct Reply {
    bool answers = false;
    CanFrame frame;
    bool boots = false;  ///< It has a node id for the first time, and starts with it.
  };
  /// A frame to all devices. @param active its node id now.
  Reply receive(const CanFrame& frame, std::uint8_t active, const lss::Identity& own) noexcept;

  /// Its node id from the next reset on, and what it would be after its power was off.
  [[nodiscard]] std::uint8_t pending() const noexcept { return pending_; }
  [[nodiscard]] std::uint8_t stored() const noexcept { return stored_; }
  void set_node_id(std::uint8_t id) noexcept { pending_ = stored_ = id; }
  [[nodiscard]] bool waiting() const noexcept { return state_ == lss::State::kWaiting; }

  // As some devices: a store that fails with this code; an id that is not taken.
  void fail_store(std::uint8_t error) noexcept { store_error_ = error; }
  void fail_node_id(std::uint8_t error) noexcept { node_id_error_ = error; }

 private:
  Reply configure(const lss::Message& asked, std::uint8_t active, const lss::Identity& own) noexcept;

  lss::State state_ = lss::State::kWaiting;
  std::uint8_t pending_ = lss::kNoNodeId, stored_ = lss::kNoNodeId;
  std::uint8_t store_error_ = 0, node_id_error_ = 0;
  lss::Identity selected_, low_, high_;  // as named so far
};

}  // namespace knuckle::sim
