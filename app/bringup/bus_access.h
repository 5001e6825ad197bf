// The simulated machine's bus to work on, on virtual time.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "core/time.h"
#include "machine/description.h"
#include "sim/simulated_machine.h"
#include "transport/bus_access.h"
#include "transport/virtual_can.h"

namespace knuckle::bringup {

/// The simulated machine at the far end of a virtual bus.
struct SimulatedBus {
  static constexpr std::size_t kControllerPort = 0, kMachinePort = 1;
  SimulatedBus(const sim::MachineTruth& truth, const JointVector& start_rad, std::uint64_t seed);
  /// In steps of a millisecond.
  Time advance(Time due);

  VirtualCanBus bus;
  sim::SimulatedMachine machine;
  Time now{};
  /// Called after every millisecond; for tests.
  std::function<void(SimulatedBus&)> each_ms;
};

[[nodiscard]] BusAccess simulated_access(std::shared_ptr<SimulatedBus> simulated);
/// In the middle of its range. @param read the machine file as it was read, not calibrated: what was calibrated on this
/// machine must not make it another one.
[[nodiscard]] BusAccess simulated_access(const MachineDescription& read, std::uint64_t seed);

}  // namespace knuckle::bringup
