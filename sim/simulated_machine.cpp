#include "sim/simulated_machine.h"

#include <utility>

namespace knuckle::sim {

namespace {

SensorErrors errors_of(const MachineTruth& truth) {
  SensorErrors errors;
  for (std::size_t i = 0; i < truth.pressure.size(); ++i) {
    errors.pressure_gain[i] = truth.pressure[i].gain;
    errors.pressure_offset_Pa[i] = truth.pressure[i].offset_Pa;
    errors.pressure_noise_Pa[i] = truth.pressure[i].noise_Pa;
  }
  errors.encoder_offset_m = truth.encoder_offset_m;
  errors.tilt_offset_rad = truth.tilt_offset_rad;
  errors.tilt_noise_rad = truth.tilt_noise_rad;
  return errors;
}

}  // namespace

SimulatedMachine::SimulatedMachine(const MachineTruth& truth, const WorldDescription& world,
                                   const JointVector& start_rad, CanBus& port, std::uint64_t seed)
    : plant_(truth, world, start_rad), nodes_(truth.machine, errors_of(truth), port, seed) {}

void SimulatedMachine::step(Time now) noexcept {
  if (last_ != kNever && now > last_) {
    const NodeOutputs asked = nodes_.outputs();
    for (int j = 0; j < kJoints; ++j) plant_.set_valve_demand(j, asked.spool_demand[j]);
    plant_.set_pilot(asked.pilot);
    plant_.step(now - last_);
  }
  last_ = now;
  nodes_.step(now, signals());
}

MachineSignals SimulatedMachine::signals() const noexcept {
  const PlantState& state = plant_.state();
  MachineSignals signals{state.spool, state.transmitter_Pa, state.cylinder_m, state.cylinder_mps, state.tilt_hull_rad};
  for (std::size_t j = 0; j < kJoints; ++j) {
    if (swapped_[j]) std::swap(signals.pressure_Pa[2 * j], signals.pressure_Pa[2 * j + 1]);
  }
  const SensorDescription& sensors = plant_.truth().machine.sensors;
  if (sensors.tilt_mount == SensorDescription::TiltMount::kOnBoom) signals.slope_rad = state.tilt_boom_rad;
  return signals;
}

}  // namespace knuckle::sim
