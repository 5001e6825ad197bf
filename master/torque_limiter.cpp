// Size, motor heat and slew of joint torques.
#include "master/torque_limiter.h"

#include <algorithm>
#include <cmath>

namespace knuckle::master {
namespace {

constexpr double kWarm = 0.8;           // heat where peak current begins to be taken back
constexpr double kHoldingShare = 0.97;  // of rated current, allowed for ever

}  // namespace

TorqueLimiter::TorqueLimiter(const DeviceDescription& device) noexcept
    : slew_N_per_s_(1e3 * device.feel.slew_N_per_ms), limit_N_(device.feel.force_limit_N) {
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto row = Eigen::Index(i);
    rated_Nm_[row] = device.gear_ratio[i] * device.torque_constant_Nm_per_A[i] * device.rated_current_A[i];
    peak_share_[row] = device.peak_current_A[i] / device.rated_current_A[i];
    heat_time_s_[row] = device.thermal_time_constant_s[i];
  }
}

JointVector TorqueLimiter::step(const JointVector& wanted_Nm, const PlanarJacobian& jacobian, double dt_s) noexcept {
  const JointVector finite_Nm = wanted_Nm.allFinite() ? wanted_Nm : JointVector::Zero();
  size_share_ = limit_N_ / std::max(limit_N_, size_N(finite_Nm, jacobian));
  heat_share_ = share_within_heat(size_share_ * finite_Nm);
  torque_Nm_ = within_slew(share() * finite_Nm, jacobian, dt_s);
  const Eigen::Array3d share = torque_Nm_.array() / rated_Nm_.array();
  heat_.array() += (share.square() - heat_.array()) * dt_s / heat_time_s_.array();
  return torque_Nm_;
}

void TorqueLimiter::rest(double dt_s) noexcept {
  torque_Nm_.setZero();
  size_share_ = heat_share_ = 1;
  heat_.array() -= heat_.array() * dt_s / heat_time_s_.array();
}

double TorqueLimiter::size_N(const JointVector& torque_Nm, const PlanarJacobian& jacobian) noexcept {
  double size_N = tip_force_of(jacobian, torque_Nm).norm();
  for (Eigen::Index i = 0; i < kJoints; ++i) {
    const double reach_m = std::max(jacobian.col(i).norm(), 1e-3);
    size_N = std::max(size_N, std::abs(torque_Nm[i]) / reach_m);
  }
  return size_N;
}

double TorqueLimiter::share_within_heat(const JointVector& torque_Nm) const noexcept {
  double share = 1;
  for (Eigen::Index i = 0; i < kJoints; ++i) {
    const double warm = std::clamp((heat_[i] - kWarm) / (1 - kWarm), 0.0, 1.0);
    const double allowed_Nm = rated_Nm_[i] * std::lerp(peak_share_[i], kHoldingShare, warm);
    const double asked_Nm = std::abs(torque_Nm[i]);
    if (asked_Nm > allowed_Nm) share = std::min(share, allowed_Nm / asked_Nm);
  }
  return share;
}

JointVector TorqueLimiter::within_slew(const JointVector& torque_Nm, const PlanarJacobian& jacobian,
                                       double dt_s) const noexcept {
  const JointVector change_Nm = torque_Nm - torque_Nm_;
  const double limit_N = slew_N_per_s_ * dt_s, change_N = size_N(change_Nm, jacobian);
  return change_N > limit_N ? JointVector(torque_Nm_ + change_Nm * (limit_N / change_N)) : torque_Nm;
}

}  // namespace knuckle::master
