#include "estimation/observer.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "machine/oil_stiffness.h"

namespace knuckle::estimation {

RodVibration::RodVibration(const MachineDescription& machine, double step_s) noexcept
    : step_s_(step_s),
      first_(kHighest_Hz, step_s, JointVector::Zero()),
      second_(kHighest_Hz, step_s, JointVector::Zero()),
      slow_(kLowest_Hz, step_s, JointVector::Zero()) {
  const SensorDescription& sensors = machine.sensors;
  const double noise_Pa = std::hypot(sensors.pressure_noise_Pa, sensors.pressure_step_Pa / std::sqrt(12.0));
  const double pole = std::exp(-2 * std::numbers::pi * kHighest_Hz * step_s);
  // Deviation of white noise that is differentiated behind two poles, and the peak of a single step.
  const double noise_1ps = (1 - pole) / step_s * std::sqrt(2 * (1 - pole) / std::pow(1 + pole, 3));
  const double one_step_1ps = 2 * std::numbers::pi * kHighest_Hz / std::numbers::e;
  const double quiet_Paps = std::max(kQuiet * noise_1ps * noise_Pa, one_step_1ps * sensors.pressure_step_Pa);
  for (int i = 0; i < kJoints; ++i) {
    const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(i)];
    const double middle_m = (cylinder.min_length_m + cylinder.max_length_m) / 2;
    m_per_N_[i] = 1 / oil_stiffness_N_per_m(cylinder, machine.hydraulics, middle_m);
    quiet_mps_[i] = quiet_Paps * m_per_N_[i] * std::hypot(cylinder.head_area_m2(), cylinder.rod_side_area_m2());
  }
}

void RodVibration::reset(const JointVector& cylinder_N) noexcept {
  last_N_ = cylinder_N;
  first_.reset(JointVector::Zero());
  second_.reset(JointVector::Zero());
  slow_.reset(JointVector::Zero());
  speed_mps_.setZero();
}

void RodVibration::step(const JointVector& cylinder_N) noexcept {
  const JointVector rate = second_.step(first_.step((last_N_ - cylinder_N) / step_s_));
  last_N_ = cylinder_N;
  const JointVector moved = m_per_N_.cwiseProduct(rate);
  speed_mps_ = ((moved - slow_.step(moved)).cwiseAbs() - quiet_mps_).cwiseMax(0.0);
}

void MomentumObserver::reset(const JointVector& momentum, const JointVector& imbalance_Nm) noexcept {
  momentum_.reset(momentum);
  imbalance_.reset(imbalance_Nm);
  inertial_Nm_.setZero();
  external_Nm_ = imbalance_Nm;
}

const JointVector& MomentumObserver::step(const JointVector& momentum, const JointVector& imbalance_Nm) noexcept {
  inertial_Nm_ = gain_ * (momentum - momentum_.step(momentum));
  external_Nm_ = inertial_Nm_ + imbalance_.step(imbalance_Nm);
  return external_Nm_;
}

ObserverChannel::ObserverChannel(const ChannelBand& band, double step_s, const JointVector& length_step_m) noexcept
    : period_s(step_s),
      one_step_mps(length_step_m * 2 * std::numbers::pi * band.velocity_Hz / std::numbers::e),
      one_step_share(length_step_m.unaryExpr(
          [](double step_m) { return std::min(1.0, DahlState::kTurnDistance_m / (kStepsToTurn * step_m)); })),
      first(band.velocity_Hz, step_s, JointVector::Zero()),
      rate(band.velocity_Hz, step_s),
      observer(band.observer_Hz, step_s) {
  rest();
}

void ObserverChannel::rest() noexcept {
  first.reset(JointVector::Zero());
  rate.reset(JointVector::Zero());
  dahl = {};
}

void ObserverChannel::move(const JointVector& joint_step_rad, const JointVector& new_lever_m,
                           const JointVector& vibration_mps, bool held) noexcept {
  lever_m = new_lever_m;
  cylinder_mps = lever_m.cwiseProduct(rate.step(first.step(joint_step_rad / period_s)));
  for (int i = 0; i < kJoints; ++i) {
    DahlState& state = dahl[static_cast<std::size_t>(i)];
    const double seen_mps = cylinder_mps[i];
    const bool stands = held && std::abs(seen_mps) <= one_step_mps[i];
    state.step(stands ? one_step_share[i] * seen_mps : seen_mps, period_s);
    if (stands) state.release(std::max(0.0, vibration_mps[i] - kOneWay * std::abs(seen_mps)) * period_s);
    if (!held) state.settle(seen_mps, period_s);
    bristle[i] = state.value();
  }
}

JointVector ObserverChannel::friction_Nm(const PerJoint<CylinderFriction>& friction, const JointVector& cylinder_Nm,
                                         const JointVector& pressure_sum_Pa) const noexcept {
  JointVector torque;
  for (int i = 0; i < kJoints; ++i) {
    const double cylinder_N = cylinder_Nm[i] / (lever_m[i] + (lever_m[i] < 0 ? -kTinyLever_m : kTinyLever_m));
    torque[i] = lever_m[i] * friction[static_cast<std::size_t>(i)].force_N(bristle[i], cylinder_mps[i], cylinder_N,
                                                                           pressure_sum_Pa[i]);
  }
  return torque;
}

}  // namespace knuckle::estimation
