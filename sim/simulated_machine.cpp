#include "sim/simulated_machine.h"

#include <cmath>
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
  errors.encoder_noise_m = truth.encoder_noise_m;
  errors.tilt_offset_rad = truth.tilt_offset_rad;
  errors.tilt_noise_rad = truth.tilt_noise_rad;
  return errors;
}

}  // namespace

SimulatedMachine::SimulatedMachine(const MachineTruth& truth, const WorldDescription& world,
                                   const JointVector& start_rad, CanBus& port, std::uint64_t seed)
    : plant_(truth, world, start_rad),
      nodes_(truth.machine, errors_of(truth), port, seed),
      felt_Pa_(plant_.state().transmitter_Pa) {}

void SimulatedMachine::step(Time now) noexcept {
  if (last_ != kNever && now > last_) {
    const NodeOutputs asked = nodes_.outputs();
    for (int j = 0; j < kJoints; ++j) plant_.set_valve_demand(j, asked.spool_demand[j]);
    plant_.set_pilot(asked.pilot);
    plant_.step(now - last_);
    feel(now - last_);
  }
  last_ = now;
  nodes_.step(now, signals());
}

void SimulatedMachine::feel(Duration time) noexcept {
  if (time != felt_for_) {
    felt_for_ = time;
    for (std::size_t i = 0; i < felt_Pa_.size(); ++i) {
      const double lag_s = plant_.truth().pressure[i].lag_s;
      share_[i] = lag_s > 0 ? 1 - std::exp(-to_seconds(time) / lag_s) : 1;
    }
  }
  const auto& true_Pa = plant_.state().transmitter_Pa;
  for (std::size_t i = 0; i < felt_Pa_.size(); ++i) {
    felt_Pa_[i] = share_[i] < 1 ? felt_Pa_[i] + share_[i] * (true_Pa[i] - felt_Pa_[i]) : true_Pa[i];
  }
}

MachineSignals SimulatedMachine::signals() const noexcept {
  const PlantState& state = plant_.state();
  MachineSignals signals{state.spool, felt_Pa_, state.cylinder_m, state.cylinder_mps, state.tilt_hull_rad};
  const SensorDescription& sensors = plant_.truth().machine.sensors;
  if (sensors.tilt_mount == SensorDescription::TiltMount::kOnBoom) signals.slope_rad = state.tilt_boom_rad;
  return signals;
}

}  // namespace knuckle::sim
