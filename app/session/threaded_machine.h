// The simulated machine with its bus, for a thread of its own: a loop in another thread meets it as on the machine,
// through a CAN controller.
#pragma once

#include <cstdint>

#include "core/joints.h"
#include "core/time.h"
#include "sim/simulated_machine.h"
#include "sim/truth.h"
#include "sim/world.h"
#include "transport/can_bus.h"
#include "transport/thread_wires.h"
#include "transport/virtual_can.h"

namespace knuckle::session {

class ThreadedMachine {
 public:
  static constexpr Duration kTick = 1ms;
  /// Below the loops: the slave decides what the valves do, this only plays the world.
  static constexpr int kPriority = 70;

  /// @param seed of the sensor noise. @throws InputError where truth and world do not fit together.
  ThreadedMachine(const sim::MachineTruth& truth, const sim::WorldDescription& world, const JointVector& start_rad,
                  std::uint64_t seed)
      : bus_(2, truth.machine.bus.bit_rate), machine_(truth, world, start_rad, bus_.port(kMachinePort), seed) {}

  /// For the thread of the loop.
  [[nodiscard]] CanBus& controller() noexcept { return can_.controller(); }

  // For the thread of the machine.
  /// Every tick.
  void step(Time now) noexcept {
    can_.exchange(bus_.port(kControllerPort));
    bus_.advance(now);
    can_.exchange(bus_.port(kControllerPort));
    // The plant moves in whole milliseconds; a period that was skipped is made up for in one longer step.
    machine_.step(Time(now.time_since_epoch() / kTick * kTick));
  }
  [[nodiscard]] const sim::PlantState& plant() const noexcept { return machine_.plant().state(); }
  /// Before the first step.
  void set_tap(CanTap tap) noexcept { bus_.set_tap(tap); }

 private:
  static constexpr std::size_t kControllerPort = 0, kMachinePort = 1;
  ThreadCan can_;
  VirtualCanBus bus_;
  sim::SimulatedMachine machine_;
};

}  // namespace knuckle::session
