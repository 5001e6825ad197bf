#include "sim/machine_on_bus.h"

#include <cmath>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/loop_table.h"

namespace knuckle::sim {

MachineOnBus::MachineOnBus(const MachineTruth& truth, const WorldDescription& world, const JointVector& start_rad,
                           std::uint64_t seed, CanBus* wire)
    : nodes_end_(wire != nullptr ? *wire : bus_.emplace(2, truth.machine.bus.bit_rate).port(kMachinePort)),
      machine_(truth, world, start_rad, nodes_end_, seed) {}

Time MachineOnBus::advance(Time due) {
  if (now_ == kNever) step(Time{});
  while (now_ < due) {
    step(now_ + kTick);
    if (each_tick) each_tick(*this);
  }
  return now_;
}

Duration period_in_ticks(const MachineDescription& machine) {
  const Duration period = from_seconds(1 / machine.bus.sync_Hz);
  if (period % kTick == Duration::zero()) return period;
  throw InputError(machine.source + ": key 'bus.sync_Hz' = " + std::to_string(machine.bus.sync_Hz) +
                   ": its period must be whole milliseconds");
}

BusAccess access_to(std::shared_ptr<MachineOnBus> machine) {
  std::shared_ptr<CanBus> port(machine, &machine->controllers_end());
  BusAccess access("simulated bus", std::move(port), [machine](Time due) { return machine->advance(due); });
  access.press_e_stop = [machine](bool pressed) { machine->machine().set_estop(pressed); };
  access.tape_m = [machine](int joint) {
    constexpr double kTape_m = 1e-3;
    return std::round(machine->plant().cylinder_m[joint] / kTape_m) * kTape_m;
  };
  return access;
}

}  // namespace knuckle::sim
