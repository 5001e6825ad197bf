// The estimator on the simulated hydraulic machine: drawn truth, valves driven by a plain position loop, transmitters
// and wire encoders as coarse as the real ones. What the estimator sees comes from sensors alone.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>

#include "estimation/force_estimator.h"
#include "estimation/payload.h"
#include "machine/kinematics.h"
#include "machine/load.h"
#include "sim/plant.h"
#include "sim/truth.h"

namespace knuckle::estimation {

class PlantRig {
 public:
  PlantRig(const MachineDescription& nominal, const sim::MachineTruth& truth, const sim::WorldDescription& world,
           const JointVector& start_rad, unsigned seed)
      : nominal_(nominal),
        kinematics_(nominal),
        filter_(nominal, kStep_s, 5),
        estimator_(nominal, kStep_s),
        payload_(nominal, kStep_s),
        plant_(truth, world, start_rad),
        random_(seed) {
    plant_.set_pilot(true);
    sense();
  }

  /// Follows a reference for one step: joint angles and rates.
  const ForceEstimate& follow(const JointVector& reference_rad, const JointVector& reference_radps) {
    for (int i = 0; i < kJoints; ++i) {
      const double wanted = state_.lever_m[i] * (reference_radps[i] + 3 * (reference_rad[i] - state_.angle_rad[i]));
      plant_.set_valve_demand(i, command(i, wanted));
    }
    return advance();
  }
  /// Spools closed.
  const ForceEstimate& hold() {
    for (int i = 0; i < kJoints; ++i) plant_.set_valve_demand(i, 0);
    return advance();
  }

  [[nodiscard]] const JointState& state() const { return state_; }
  [[nodiscard]] const sim::PlantState& truth() const { return plant_.state(); }
  [[nodiscard]] const ForceEstimator& estimator() const { return estimator_; }
  [[nodiscard]] PayloadEstimator& payload() { return payload_; }
  [[nodiscard]] const Kinematics& kinematics() const { return kinematics_; }
  [[nodiscard]] double time_s() const { return plant_.state().t_s; }

 private:
  [[nodiscard]] double command(int joint, double wanted_mps) const {
    const auto i = static_cast<std::size_t>(joint);
    const CylinderDescription& c = nominal_.cylinders[i];
    const double full = c.valve.nominal_flow_m3ps / c.head_area_m2();
    const double edge = 0.9 * c.valve.dead_band_extend * std::tanh(wanted_mps / 0.004);
    return std::clamp(edge + (1 - c.valve.dead_band_extend) * wanted_mps / full, -1.0, 1.0);
  }
  const ForceEstimate& advance() {
    plant_.step(std::chrono::milliseconds(5));
    sense();
    payload_.step(state_, estimator_.step(state_));
    estimator_.hold_bias(payload_.maybe_loaded());
    estimator_.carry(payload_.carried());
    return estimator_.estimate();
  }
  static double quantised(double value, double step) { return std::round(value / step) * step; }
  void sense() {
    const sim::PlantState& p = plant_.state();
    const sim::MachineTruth& t = plant_.truth();
    Measurement m;
    for (std::size_t i = 0; i < 6; ++i) {
      const double read = t.pressure[i].gain * p.transmitter_Pa[i] + t.pressure[i].offset_Pa +
                          t.pressure[i].noise_Pa * normal_(random_);
      m.pressure_Pa[i] = quantised(read, nominal_.sensors.pressure_step_Pa);
    }
    for (int i = 0; i < kJoints; ++i)
      m.cylinder_m[i] = quantised(p.cylinder_m[i] + t.encoder_offset_m[i], nominal_.sensors.encoder_step_m);
    m.hull_pitch_rad = quantised(p.tilt_hull_rad + t.tilt_offset_rad, nominal_.sensors.tilt_step_rad);
    if (const std::optional<JointState> state = filter_.step(m)) state_ = *state;
  }

  MachineDescription nominal_;
  Kinematics kinematics_;
  JointStateFilter filter_;
  ForceEstimator estimator_;
  PayloadEstimator payload_;
  sim::Plant plant_;
  JointState state_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_{0, 1};
};

}  // namespace knuckle::estimation
