// A joint torque that is not known has an infinite variance in every covariance, and any finite value. Its rows and
// columns say nothing then, so all that is estimated from torques rests on the others.
#pragma once

#include <Eigen/Core>
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
