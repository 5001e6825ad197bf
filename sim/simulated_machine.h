// The whole machine as the bus sees it: the plant behind its CANopen nodes. Controllers meet it only through frames.
#pragma once

#include <array>
#include <cstdint>

#include "core/time.h"
#include "sim/can_nodes.h"
#include "sim/plant.h"
#include "sim/truth.h"
#include "sim/world.h"
#include "transport/can_bus.h"

namespace knuckle::sim {

class SimulatedMachine {
 public:
  /// @param port the nodes' side of the bus; must outlive the machine. @param seed of the sensor noise.
  /// @throws InputError as Plant does.
  SimulatedMachine(const MachineTruth& truth, const WorldDescription& world, const JointVector& start_rad, CanBus& port,
                   std::uint64_t seed);

  /// Moves the plant to `now` with what the nodes asked for at the last call, then lets the nodes hear, sample and
  /// send. The first call only sets the time. Steps are multiples of 0.25 ms; call it after the bus has advanced.
  void step(Time now) noexcept;

  [[nodiscard]] Plant& plant() noexcept { return plant_; }
  [[nodiscard]] const Plant& plant() const noexcept { return plant_; }
  [[nodiscard]] CanNodes& nodes() noexcept { return nodes_; }
  [[nodiscard]] const CanNodes& nodes() const noexcept { return nodes_; }

  // Faults of the machine. False where no node has this id or its kind cannot have this fault.
  bool inject(std::uint8_t node, NodeFault fault) noexcept { return nodes_.inject(node, fault); }
  bool send_emcy(std::uint8_t node, std::uint16_t code) noexcept { return nodes_.send_emcy(node, code); }
  void set_estop(bool pressed) noexcept { nodes_.set_estop(pressed); }

 private:
  /// @param now at most a tick after the last.
  void step_once(Time now) noexcept;
  /// The transmitters' own lag.
  void feel(Duration time) noexcept;
  /// What the encoders' wires follow: askew, and slack after a reversal.
  void draw_wires() noexcept;
  [[nodiscard]] double ripple_Pa(std::size_t channel) const noexcept;
  [[nodiscard]] MachineSignals signals() const noexcept;

  Plant plant_;
  CanNodes nodes_;
  std::array<double, 6> felt_Pa_, share_{};  // of the way to the true pressure within felt_for_
  Duration felt_for_{};
  JointVector wire_m_, wire_mps_ = JointVector::Zero();
  Time last_ = kNever;
};

}  // namespace knuckle::sim
