// How joints move a point in the arm's plane, and back. Of machine and haptic device alike. Allocation-free.
#pragma once

#include <Eigen/Core>

#include "core/joints.h"

namespace knuckle {

/// d point / d joints [m/rad], rows x and z. Joint torque of a force f on the point is J^T f.
using PlanarJacobian = Eigen::Matrix<double, 2, kJoints>;

/// Of another point of the link that the tip is on: all joints turn it about the tip alike.
[[nodiscard]] PlanarJacobian beside_tip(const PlanarJacobian& tip, const PlanarVector& from_tip_m) noexcept;

/// Pseudo-inverse of a point's Jacobian, W J^T (J W J^T + damping I)^-1. The damping [m^2 times the weights] keeps it
/// finite where the arm is stretched, and makes the arm stiff there instead of wild.
class PlanarInverse {
 public:
  PlanarInverse(const PlanarJacobian& jacobian, const JointVector& weight, double damping) noexcept;

  /// Of the joint motions that move the point by this the one with the least sum of motion^2 / weight.
  [[nodiscard]] JointVector joints(const PlanarVector& motion) const noexcept;
  [[nodiscard]] Eigen::Matrix<double, kJoints, 2> matrix() const noexcept;

  /// The force on the point that explains joint torques best, by their weights.
  [[nodiscard]] PlanarVector force_N(const JointVector& torque_Nm) const noexcept;

 private:
  Eigen::Matrix<double, kJoints, 2> weighted_;
  Eigen::Matrix2d inverse_;
};

}  // namespace knuckle
