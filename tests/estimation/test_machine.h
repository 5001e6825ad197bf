// A machine of the 1.5 t class for the estimator's tests, numbers as published for it, and a synthetic twin of it that
// is exactly the regressor model: free of the simulator, so that a test knows every error it puts in.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "estimation/force_estimator.h"
#include "estimation/friction.h"
#include "estimation/joint_state.h"
#include "estimation/regressor.h"
#include "machine/description.h"
#include "machine/kinematics.h"
#include "machine/oil_stiffness.h"

namespace knuckle::estimation {

inline PlanarVector at_angle(double radius_m, double angle_deg) {
  const double a = angle_deg * std::numbers::pi / 180;
  return radius_m * PlanarVector(std::cos(a), std::sin(a));
}

inline MachineDescription test_machine() {
  constexpr double kScale = 0.854;
  MachineDescription m;
  m.name = "test";
  m.links[0] = {1.75, 100, at_angle(.9865, 11.48), 32, -.474, 1.092, 0.8};
  m.links[1] = {0.95, 60, at_angle(28.30 / 60, -2.67), 6, -2.585, -.510, 1.2};
  m.links[2] = {0.50, 60, at_angle(26.01 / 60, 31.82), 2, -2.5, .784, 1.5};
  m.boom_mount = {kScale * PlanarVector(.135, -.264), kScale * PlanarVector(1.025, .278)};
  m.arm_mount = {kScale * PlanarVector(.977, .737), kScale * PlanarVector(-.251, .158)};
  m.bucket_linkage.cylinder_pin_m = kScale * PlanarVector(-.134, .320);
  m.bucket_linkage.rocker_pin_m = kScale * PlanarVector(.880, 0);
  m.bucket_linkage.bucket_pin_m = kScale * PlanarVector(-.014, .164);
  m.bucket_linkage.rocker_length_m = m.bucket_linkage.coupler_length_m = kScale * .240;
  const auto cylinder = [](double bore, double rod, double shortest, double longest, double coulomb) {
    CylinderDescription c;
    c.bore_m = bore;
    c.rod_m = rod;
    c.min_length_m = shortest;
    c.max_length_m = longest;
    c.friction = {coulomb, 1.4, 0.01, 20e3};
    return c;
  };
  m.cylinders = {cylinder(.065, .035, .76, 1.13, 350), cylinder(.060, .035, .88, 1.34, 300),
                 cylinder(.060, .035, .77, 1.09, 250)};
  m.sensors.pressure_step_Pa = 0.1e5;
  m.sensors.pressure_noise_Pa = 0.3e5;
  m.sensors.encoder_step_m = 1e-4;
  m.hydraulics.main_relief_Pa = 205e5;
  m.hydraulics.bulk_modulus_Pa = 1e9;
  m.hydraulics.hose_volume_m3 = 3e-4;
  m.payload_full_scale_kg = 150;
  return m;
}

/// It with the outline of a bucket.
inline MachineDescription machine_with_outline() {
  MachineDescription machine = test_machine();
  machine.bucket_profile = {{0.42, 0.065}, {0.25, 0.19}, {0.02, 0.18}, {0.25, -0.005}};
  return machine;
}

inline constexpr double kStep_s = 0.005;
/// A pose with all joints bent, and how uncertain torques are there.
inline const JointVector kBent(0.3, -1.5, -0.9), kSigma_Nm(40, 25, 10);
inline const Eigen::Matrix3d kCovariance_Nm2 = kSigma_Nm.cwiseAbs2().asDiagonal();

/// Exact joint motion: a sum of two sines per joint about the middle of the range.
struct SineMotion {
  JointVector middle_rad = JointVector(0.3, -1.5, -0.9);
  JointVector amplitude_rad = JointVector(0.25, 0.35, 0.6);
  JointVector omega_radps = JointVector(0.5, 0.62, 0.71);
  JointVector swing_rad = JointVector::Zero();  ///< On top of it, as an arm swings on its oil.
  double swing_radps = 12;
  JointVector growth_radps = JointVector::Zero(), growth_radps2 = JointVector::Zero();  ///< Rates of swing_rad.
  /// The swing grows with the square of a sine. @param phase_rad of that sine: at pi / 2 it is largest.
  void grow_swing(const JointVector& most_rad, double phase_rad, double phase_radps) {
    swing_rad = std::pow(std::sin(phase_rad), 2) * most_rad;
    growth_radps = phase_radps * std::sin(2 * phase_rad) * most_rad;
    growth_radps2 = 2 * phase_radps * phase_radps * std::cos(2 * phase_rad) * most_rad;
  }
  struct Point {
    JointVector angle, rate, acceleration;
  };
  [[nodiscard]] Point at(double t) const {
    Point p;
    p.angle = middle_rad + amplitude_rad.cwiseProduct(JointVector((omega_radps * t).array().sin()));
    p.rate = amplitude_rad.cwiseProduct(omega_radps).cwiseProduct(JointVector((omega_radps * t).array().cos()));
    p.acceleration = -omega_radps.array().square() * (p.angle - middle_rad).array();
    const double sine = std::sin(swing_radps * t), cosine = std::cos(swing_radps * t);
    p.angle += swing_rad * sine;
    p.rate += swing_rad * swing_radps * cosine + growth_radps * sine;
    p.acceleration +=
        (growth_radps2 - swing_rad * swing_radps * swing_radps) * sine + 2 * swing_radps * growth_radps * cosine;
    return p;
  }
};

/// What a synthetic machine has that the nominal one has not.
struct SyntheticErrors {
  JointVector bias_N = JointVector::Zero();  ///< Measured minus true cylinder force.
  double friction_factor = 1;
  double viscosity_factor = 1;
  double mass_factor = 1;         ///< Of all gravity and inertia parameters.
  double seal_m2 = 0;             ///< Friction by pressure, of every cylinder.
  double back_swing = 0;          ///< Share by which the rod side's pressure changes with the joint's speed.
  std::array<double, 6> lag_s{};  ///< Time constants of the transmitters.
  double pressure_step_Pa = 0, pressure_noise_Pa = 0, encoder_step_m = 0;
};

/// Sensor values of a machine that follows a prescribed motion, by inverse dynamics of the regressor model.
class SyntheticMachine {
 public:
  SyntheticMachine(const MachineDescription& machine, const SyntheticErrors& errors, unsigned seed = 1)
      : machine_(machine), errors_(errors), kinematics_(machine), arm_(machine), random_(seed) {}

  /// @param external_Nm torque of the world on the joints.
  Measurement measure(const SineMotion::Point& p, const JointVector& external_Nm, double hull_pitch_rad = 0) {
    const BaseParameters parameters = errors_.mass_factor * lumped_parameters(machine_);
    const JointVector torque =
        inverse_dynamics(arm_, parameters, p.angle, p.rate, p.acceleration, hull_pitch_rad) - external_Nm;
    Measurement m;
    m.hull_pitch_rad = hull_pitch_rad;
    for (int i = 0; i < kJoints; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const CylinderState cylinder = *kinematics_.cylinder_at(i, p.angle[i]);
      const double speed = cylinder.lever_m * p.rate[i];
      FrictionDescription friction = machine_.cylinders[k].friction;
      friction.coulomb_N *= errors_.friction_factor;
      friction.viscous_Ns_per_m *= errors_.friction_factor * errors_.viscosity_factor;
      const double shaken_m = ring_m_ * std::sin(2 * std::numbers::pi * kRing_Hz * ring_s_);
      const double shaken_mps =
          2 * std::numbers::pi * kRing_Hz * ring_m_ * std::cos(2 * std::numbers::pi * kRing_Hz * ring_s_);
      dahl_[k].step(speed + shaken_mps, kStep_s);
      const double bristle = held_ ? dahl_[k].value() : dahl_[k].settle(speed, kStep_s);
      const double oil_N =
          shaken_m * oil_stiffness_N_per_m(machine_.cylinders[k], machine_.hydraulics, cylinder.length_m);
      const double force =
          torque[i] / cylinder.lever_m + CylinderFriction(friction).force_N(bristle, speed) + errors_.bias_N[i] - oil_N;
      const double back = 30e5 * (1 + errors_.back_swing * std::sin(20 * speed)), seal_m2 = bristle * errors_.seal_m2;
      const double head = (force + back * (machine_.cylinders[k].rod_side_area_m2() + seal_m2)) /
                          (machine_.cylinders[k].head_area_m2() - seal_m2);
      m.pressure_Pa[2 * k] = sensed(late(head, 2 * k));
      m.pressure_Pa[2 * k + 1] = sensed(late(back, 2 * k + 1));
      m.cylinder_m[i] = quantised(cylinder.length_m, errors_.encoder_step_m);
    }
    ring_s_ += kStep_s;
    started_ = true;
    return m;
  }
  [[nodiscard]] const Kinematics& kinematics() const { return kinematics_; }
  /// While the world holds the bucket nothing rings, and bristles stay bent ...
  void hold(bool held) { held_ = held; }
  /// ... unless the rods ring on their oil by so much, which encoders do not show.
  void ring(double amplitude_m) { ring_m_ = amplitude_m; }

 private:
  static double quantised(double value, double step) { return step > 0 ? std::round(value / step) * step : value; }
  /// First order behind a pressure that is straight between the steps.
  double late(double pressure, std::size_t channel) {
    double& last = last_Pa_[channel];
    double& value = late_Pa_[channel];
    if (!started_) last = value = pressure;
    if (const double lag_s = errors_.lag_s[channel]; lag_s > 0) {
      const double rate = (pressure - last) / kStep_s, keep = std::exp(-kStep_s / lag_s);
      value = pressure - lag_s * rate + keep * (value - last + lag_s * rate);
    } else {
      value = pressure;
    }
    last = pressure;
    return value;
  }
  double sensed(double pressure) {
    return quantised(pressure + errors_.pressure_noise_Pa * normal_(random_), errors_.pressure_step_Pa);
  }

  MachineDescription machine_;
  SyntheticErrors errors_;
  Kinematics kinematics_;
  RigidArm arm_;
  std::array<DahlState, kJoints> dahl_{};
  bool held_ = false;
  static constexpr double kRing_Hz = 6;
  double ring_m_ = 0, ring_s_ = 0;
  bool started_ = false;
  std::array<double, 6> last_Pa_{}, late_Pa_{};
  std::mt19937 random_;
  std::normal_distribution<double> normal_{0, 1};
};

/// The sensors of the default machine: 0.1 bar steps, 0.3 bar noise, 0.1 mm.
inline SyntheticErrors real_sensors() {
  SyntheticErrors e;
  e.pressure_step_Pa = 0.1e5;
  e.pressure_noise_Pa = 0.3e5;
  e.encoder_step_m = 1e-4;
  return e;
}

}  // namespace knuckle::estimation
