#include "app/session/session_sides.h"

#include <string>

#include "core/error.h"

namespace knuckle::session {
namespace {

/// @throws InputError where it is no multiple of a tick.
Duration period_of(const MachineDescription& machine) {
  const Duration period = from_seconds(1 / machine.bus.sync_Hz);
  if (period % kTick == Duration::zero()) return period;
  throw InputError(machine.source + ": key 'bus.sync_Hz' = " + std::to_string(machine.bus.sync_Hz) +
                   ": its period must be whole milliseconds");
}

}  // namespace

MachineSide::MachineSide(const MachineDescription& description, const sim::MachineTruth& truth,
                         const Scenario& scenario, std::uint64_t seed, Link& link)
    : slave_period(period_of(description)),
      bus(kPorts, description.bus.bit_rate),
      nodes_end(bus.port(kMachinePort)),
      can(bus.port(kControllerPort), description.bus.bit_rate),
      slave(description, can, link),
      machine(truth, scenario.world, scenario.start_rad, nodes_end, seed) {}

}  // namespace knuckle::session
