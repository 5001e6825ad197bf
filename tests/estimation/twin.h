// A synthetic machine and the force estimator that follows it along a prescribed motion.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "estimation/force_estimator.h"
#include "tests/estimation/test_machine.h"

namespace knuckle::estimation {

/// Runs a synthetic machine along its motion; the force at the tip and the motion's clock are the test's.
class Twin {
 public:
  explicit Twin(const SyntheticErrors& errors, unsigned seed = 1, const MachineDescription& machine = test_machine())
      : machine_(machine, errors, seed), filter_(machine, kStep_s, kSlowVelocity_Hz), estimator_(machine, kStep_s) {}

  /// One step on; `speed` scales the motion's clock (0 = standstill). `joint_Nm` acts on the joints beside the force.
  const ForceEstimate& step(const PlanarVector& tip_N, double speed = 1,
                            const JointVector& joint_Nm = JointVector::Zero()) {
    clock_s_ += kStep_s * speed;
    SineMotion::Point p = motion.at(clock_s_);
    p.rate *= speed;
    p.acceleration *= speed * speed;
    const JointVector torque = machine_.kinematics().tip_jacobian(p.angle).transpose() * tip_N + joint_Nm;
    Measurement measurement = machine_.measure(p, torque, hull_pitch_rad);
    measurement.pressures_known = pressures_known;
    for (std::size_t i = 0; i < kJoints; ++i)
      if (!pressures_known[i]) measurement.pressure_Pa[2 * i] = measurement.pressure_Pa[2 * i + 1] = unmeasured_Pa;
    const std::optional<JointState> state = filter_.step(measurement);
    EXPECT_TRUE(state);
    angle_rad = p.angle;
    return estimator_.step(*state);
  }
  const ForceEstimate& free_motion(double seconds) {
    for (double t = 0; t < seconds; t += kStep_s) step(PlanarVector::Zero());
    return estimator_.estimate();
  }
  /// RMS of the tip force in free motion.
  double no_load_N(double seconds) {
    double sum = 0;
    int n = 0;
    for (double t = 0; t < seconds; t += kStep_s, ++n) sum += step(PlanarVector::Zero()).tip_N.squaredNorm();
    return std::sqrt(sum / n);
  }
  /// Brings the motion to a stop within a second.
  void stop() {
    for (double speed = 1; speed > 0; speed -= kStep_s) step(PlanarVector::Zero(), speed);
    for (double t = 0; t < 1; t += kStep_s) step(PlanarVector::Zero(), 0);
  }
  /// The sensors are away while the motion goes on.
  void gap(double seconds) {
    clock_s_ += seconds;
    filter_.reset();
    estimator_.restart_motion();
  }
  /// The world holds the bucket: friction at rest stays.
  void hold() { machine_.hold(true); }
  /// Rods ring on their oil.
  void ring(double amplitude_m) { machine_.ring(amplitude_m); }
  ForceEstimator& estimator() { return estimator_; }

  SineMotion motion;
  JointVector angle_rad = JointVector::Zero();
  double hull_pitch_rad = 0;
  PerJoint<bool> pressures_known{true, true, true};
  double unmeasured_Pa = 0;  ///< What stands in the place of pressures that nobody measures.

 private:
  SyntheticMachine machine_;
  JointStateFilter filter_;
  ForceEstimator estimator_;
  double clock_s_ = 0;
};

inline SyntheticErrors oil_of_today() {
  SyntheticErrors e = real_sensors();
  e.bias_N = JointVector(400, -300, 350);
  e.friction_factor = 1.25;
  e.viscosity_factor = 1.1;
  e.mass_factor = 1.04;
  return e;
}

/// The twin of oil_of_today() with all that an identification would have told about it: parameters that fit, and how
/// well they are known.
inline MachineDescription calibrated_twin(const SyntheticErrors& errors, double friction_sigma_N) {
  MachineDescription machine = test_machine();
  DynamicsCalibration found;
  found.parameters.head<kBaseCount>() = errors.mass_factor * lumped_parameters(machine);
  for (int i = 0; i < kBaseCount; ++i) found.covariance(i, i) = std::pow(0.01 * found.parameters[i], 2);
  for (int i = 0; i < kJoints; ++i) {
    const FrictionDescription& drawn = machine.cylinders[static_cast<std::size_t>(i)].friction;
    const double coulomb = errors.friction_factor * drawn.coulomb_N;
    found.parameters[friction_index(i, kCoulombExtend)] = coulomb + errors.bias_N[i];
    found.parameters[friction_index(i, kCoulombRetract)] = coulomb - errors.bias_N[i];
    found.parameters[friction_index(i, kViscous)] = errors.friction_factor * drawn.viscous_Ns_per_m;
    found.parameters[friction_index(i, kBreakaway)] = coulomb * (drawn.static_ratio - 1);
    for (const FrictionIndex which : {kCoulombExtend, kCoulombRetract})
      found.covariance(friction_index(i, which), friction_index(i, which)) = friction_sigma_N * friction_sigma_N;
    found.stribeck_mps[i] = drawn.stribeck_mps;
  }
  found.residual_rms_Nm = JointVector(15, 10, 5);
  machine.dynamics_calibration = found;
  return machine;
}

}  // namespace knuckle::estimation
