// Soft walls at the ends of the machine's working range.
#include "master/joint_walls.h"

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
    const auto row = Eigen::Index(i);
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

}  // namespace knuckle::master
