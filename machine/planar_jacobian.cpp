#include "machine/planar_jacobian.h"

#include <Eigen/LU>

namespace knuckle {

PlanarJacobian beside_tip(const PlanarJacobian& tip, const PlanarVector& from_tip_m) noexcept {
  return tip + PlanarVector(-from_tip_m.y(), from_tip_m.x()) * Eigen::RowVector3d::Ones();
}

PlanarInverse::PlanarInverse(const PlanarJacobian& jacobian, const JointVector& weight, double damping) noexcept
    : weighted_(weight.asDiagonal() * jacobian.transpose()),
      inverse_((jacobian * weighted_ + damping * Eigen::Matrix2d::Identity()).inverse()) {}

JointVector PlanarInverse::joints(const PlanarVector& motion) const noexcept {
  return weighted_ * (inverse_ * motion);
}

Eigen::Matrix<double, kJoints, 2> PlanarInverse::matrix() const noexcept {
  return weighted_ * inverse_;
}

PlanarVector PlanarInverse::force_N(const JointVector& torque_Nm) const noexcept {
  return inverse_.transpose() * (weighted_.transpose() * torque_Nm);
}

}  // namespace knuckle
