// Contact model `tip_force`: one force at the bucket tip, from three joint torques, by covariance-weighted least
// squares; what is left over tells whether one tip force explains all three.
#pragma once

#include <Eigen/Dense>
#include <cmath>

#include "core/joints.h"

namespace knuckle::estimation {

struct TipForce {
  PlanarVector force_N;  ///< Frame M, of the world on the tip.
  Eigen::Matrix2d covariance_N2;
  double residual_sigma;  ///< sqrt of the weighted residual: chi with one degree of freedom.
};

/// Larger forces than this are not believed: keeps the answer finite where the arm is straight.
inline constexpr double kForcePrior_N = 2e4;

/// Solves J^T f = torque in the least-squares sense with weights covariance^-1.
/// @param jacobian d tip / d joints in M; @param covariance_Nm2 of the torques, positive definite.
[[nodiscard]] inline TipForce solve_tip_force(const Eigen::Matrix<double, 2, 3>& jacobian, const JointVector& torque_Nm,
                                              const Eigen::Matrix3d& covariance_Nm2) noexcept {
  const Eigen::Matrix3d weight = covariance_Nm2.inverse();
  const Eigen::Matrix<double, 2, 3> jw = jacobian * weight;
  const Eigen::Matrix2d information =
      jw * jacobian.transpose() + Eigen::Matrix2d::Identity() / (kForcePrior_N * kForcePrior_N);
  TipForce result;
  result.covariance_N2 = information.inverse();
  result.force_N = result.covariance_N2 * (jw * torque_Nm);
  const JointVector left = torque_Nm - jacobian.transpose() * result.force_N;
  result.residual_sigma = std::sqrt(std::max(0.0, left.dot(weight * left)));
  return result;
}

}  // namespace knuckle::estimation
