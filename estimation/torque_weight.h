// A joint torque that is not known has an infinite variance in every covariance, and any finite value. Its rows and
// columns say nothing then, so all that is estimated from torques rests on the others.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "core/joints.h"

namespace knuckle::estimation {

inline constexpr double kUnknownVariance = std::numeric_limits<double>::infinity();

/// @param covariance_Nm2 of three joint torques.
[[nodiscard]] inline bool torque_known(const Eigen::Matrix3d& covariance_Nm2, int joint) noexcept {
  return std::isfinite(covariance_Nm2(joint, joint));
}
[[nodiscard]] inline bool all_torques_known(const Eigen::Matrix3d& covariance_Nm2) noexcept {
  return covariance_Nm2.diagonal().allFinite();
}

/// Inverse of the covariance of the torques that are known; zero for the others.
[[nodiscard]] inline Eigen::Matrix3d torque_weight(const Eigen::Matrix3d& covariance_Nm2) noexcept {
  if (all_torques_known(covariance_Nm2)) return covariance_Nm2.inverse();
  Eigen::Matrix3d known = Eigen::Matrix3d::Identity();
  for (int i = 0; i < kJoints; ++i)
    for (int j = 0; j < kJoints; ++j)
      if (torque_known(covariance_Nm2, i) && torque_known(covariance_Nm2, j)) known(i, j) = covariance_Nm2(i, j);
  Eigen::Matrix3d weight = known.inverse();
  for (int i = 0; i < kJoints; ++i)
    if (!torque_known(covariance_Nm2, i)) weight(i, i) = 0;
  return weight;
}

/// torque_weight() times the torques.
[[nodiscard]] inline JointVector weighed(const Eigen::Matrix3d& covariance_Nm2, const JointVector& torque_Nm) noexcept {
  if (all_torques_known(covariance_Nm2)) return covariance_Nm2.ldlt().solve(torque_Nm);
  return torque_weight(covariance_Nm2) * torque_Nm;
}

/// Takes what is known of the joints' torques out of a covariance.
inline void forget_torques(Eigen::Matrix3d& covariance_Nm2, const PerJoint<bool>& known) noexcept {
  for (int i = 0; i < kJoints; ++i)
    if (!known[static_cast<std::size_t>(i)]) covariance_Nm2(i, i) = kUnknownVariance;
}
inline void forget_torques(JointVector& variance_Nm2, const PerJoint<bool>& known) noexcept {
  for (int i = 0; i < kJoints; ++i)
    if (!known[static_cast<std::size_t>(i)]) variance_Nm2[i] = kUnknownVariance;
}

}  // namespace knuckle::estimation
