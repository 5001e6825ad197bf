#include "app/bringup/bus_access.h"

#include <cmath>

#include "machine/pose.h"
#include "sim/truth.h"

namespace knuckle::bringup {

SimulatedBus::SimulatedBus(const sim::MachineTruth& truth, const JointVector& start_rad, std::uint64_t seed)
    : bus(2, truth.machine.bus.bit_rate), machine(truth, {}, start_rad, bus.port(kMachinePort), seed) {
  machine.step(now);
}

Time SimulatedBus::advance(Time due) {
  while (now < due) {
    now += 1ms;
    bus.advance(now);
    machine.step(now);
    if (each_ms) each_ms(*this);
  }
  return now;
}

BusAccess simulated_access(std::shared_ptr<SimulatedBus> simulated) {
  std::shared_ptr<CanBus> port(simulated, &simulated->bus.port(SimulatedBus::kControllerPort));
  BusAccess access("simulated bus", std::move(port), [simulated](Time due) { return simulated->advance(due); });
  access.press_e_stop = [simulated](bool pressed) { simulated->machine.set_estop(pressed); };
  access.tape_m = [simulated](int joint) {
    constexpr double kTape_m = 1e-3;
    return std::round(simulated->machine.plant().state().cylinder_m[joint] / kTape_m) * kTape_m;
  };
  return access;
}

BusAccess simulated_access(const MachineDescription& read, std::uint64_t seed) {
  return simulated_access(std::make_shared<SimulatedBus>(sim::draw_truth(read, seed), middle_of_range(read), seed));
}

}  // namespace knuckle::bringup
