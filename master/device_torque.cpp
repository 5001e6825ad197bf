#include "master/device_torque.h"

#include <algorithm>
#include <cmath>

#include "machine/description.h"

namespace knuckle::master {

namespace {

constexpr double kStiffness_N_per_m = 300;  // at the device's tip with the arm stretched
constexpr double kDamping_Ns_per_m = 5;
constexpr double kShareOfLimit = 0.6;  // of the hand's force limit: the wall does not mask a contact

}  // namespace

JointWalls::JointWalls(const DeviceDescription& device, const MachineDescription& machine) noexcept
    : limit_N_(kShareOfLimit * device.feel.force_limit_N) {
  double reach_m = 0;
  for (std::size_t i = kJoints; i-- > 0;) {
    const auto row = static_cast<Eigen::Index>(i);
    reach_m_[row] = reach_m += device.link_m[row];
    min_rad_[row] = machine.links[i].min_rad + machine.limits.joint_soft_margin_rad;
    max_rad_[row] = machine.links[i].max_rad - machine.limits.joint_soft_margin_rad;
  }
}

JointVector JointWalls::torque(const JointVector& setpoint_rad, const JointVector& setpoint_radps) const noexcept {
  JointVector torque_Nm = JointVector::Zero();
  for (Eigen::Index i = 0; i < kJoints; ++i) {
    const double beyond_m = reach_m_[i] * (setpoint_rad[i] - std::clamp(setpoint_rad[i], min_rad_[i], max_rad_[i]));
    if (beyond_m == 0) continue;
    const double spring_N = kStiffness_N_per_m * beyond_m;
    // Damps as much as the spring carries, so that the wall neither clicks at its edge nor pulls.
    const double damping_N =
        std::clamp(kDamping_Ns_per_m * reach_m_[i] * setpoint_radps[i], -std::abs(spring_N), std::abs(spring_N));
    torque_Nm[i] = -reach_m_[i] * std::clamp(spring_N + damping_N, -limit_N_, limit_N_);
  }
  return torque_Nm;
}

namespace {

constexpr double kFall_s = 0.5, kRise_s = 5;

}  // namespace

void EnergyPort::step(double power_to_hand_W, double dt_s) noexcept {
  const double energy_J = power_to_hand_W * dt_s;
  (energy_J > 0 ? out_J_ : in_J_) += std::abs(energy_J);
  slots_J_[slot_] += energy_J;
  window_J_ += energy_J;
  slot_filled_s_ += dt_s;
  if (slot_filled_s_ > kSlot_s - 0.5 * dt_s) {
    slot_filled_s_ = 0;
    slot_ = (slot_ + 1) % kSlots;
    slots_J_[slot_] = 0;
    window_J_ = 0;  // summed again: a running sum would drift
    for (const double slot_J : slots_J_) window_J_ += slot_J;
  }
  const double change = window_J_ > kReturnedLimit_J ? -dt_s / kFall_s : dt_s / kRise_s;
  gain_ = std::clamp(gain_ + change, 0.0, 1.0);
}

namespace {

constexpr double kWarm = 0.8;           // heat where peak current begins to be taken back
constexpr double kHoldingShare = 0.97;  // of rated current, allowed for ever

}  // namespace

TorqueLimiter::TorqueLimiter(const DeviceDescription& device) noexcept
    : slew_N_per_s_(1e3 * device.feel.slew_N_per_ms), limit_N_(device.feel.force_limit_N) {
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
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
