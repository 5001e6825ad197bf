#include "estimation/identification/projection.h"

#include <Eigen/Eigenvalues>
#include <stdexcept>

namespace knuckle::estimation {

BaseParameters project(const MachineDescription& machine, const std::vector<DynamicState>& samples) {
  using Matrix = Eigen::Matrix<double, kBaseParameters, kBaseParameters>;
  const RigidArm arm(machine);
  Matrix information = Matrix::Zero();
  BaseParameters right = BaseParameters::Zero();
  for (const DynamicState& s : samples) {
    Regressor rows =
        arm.inverse_dynamics(Pose(s.joint_rad, s.hull_pitch_rad), absolute(s.joint_radps), absolute(s.joint_radps2));
    for (int i = kJoints - 2; i >= 0; --i) rows.row(i) += rows.row(i + 1);
    for (int i = 0; i < kJoints; ++i) {
      const double weight = lever_weight(s.lever_m[i]);
      information += weight * weight * rows.row(i).transpose() * rows.row(i);
      right += weight * weight * s.joint_Nm[i] * rows.row(i).transpose();
    }
  }
  const BaseParameters scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(scale.asDiagonal() * information * scale.asDiagonal());
  if (!(eigen.eigenvalues()[0] > 1e-10 * eigen.eigenvalues()[kBaseParameters - 1]))
    throw std::invalid_argument("projection: the samples do not determine all nine base parameters");
  const BaseParameters along = eigen.eigenvectors().transpose() * scale.cwiseProduct(right);
  return scale.cwiseProduct(eigen.eigenvectors() * along.cwiseQuotient(eigen.eigenvalues()));
}

}  // namespace knuckle::estimation
