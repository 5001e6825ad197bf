// Normal matrix of the regressor along a path, and its condition.
#include "estimation/identification/path_condition.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace knuckle::estimation {
namespace {

constexpr int kFrictionColumns = 3;  ///< Coulomb extending, Coulomb retracting, viscous.
constexpr int kColumns = kBaseParameters + kJoints * kFrictionColumns;
constexpr double kSlip_mps = 1e-3;  ///< Friction turns round over this speed.
constexpr double kLeastLever_m = 0.05;
using Rows = Eigen::Matrix<double, kJoints, kColumns>;

/// Torque rows to rows of cylinder force.
Rows rows_at(const Kinematics& kinematics, const RigidArm& arm, const JointVector& angle, const JointVector& rate,
             const JointVector& acceleration) {
  Rows rows = Rows::Zero();
  const Regressor absolute_rows = arm.inverse_dynamics(Pose(angle, 0), absolute(rate), absolute(acceleration));
  for (int column = 0; column < kBaseParameters; ++column) {
    rows.col(column) = joint_torque(absolute_rows.col(column));
  }
  for (int joint = 0; joint < kJoints; ++joint) {
    const auto cylinder = kinematics.cylinder_at(joint, angle[joint]);
    const double lever = cylinder ? cylinder->lever_m : 0;
    const double speed = lever * rate[joint];
    const double slip = std::clamp(speed / kSlip_mps, -1.0, 1.0);
    const int first = kBaseParameters + joint * kFrictionColumns;
    rows(joint, first) = lever * std::max(0.0, slip);
    rows(joint, first + 1) = lever * std::min(0.0, slip);
    rows(joint, first + 2) = lever * speed;
    rows.row(joint) /= std::max(kLeastLever_m, std::abs(lever));
  }
  return rows;
}

}  // namespace

PathCondition::PathCondition(const MachineDescription& machine, bool with_inertia)
    : kinematics_(machine), arm_(machine), with_inertia_(with_inertia) {}

double PathCondition::operator()(const JointPath& path, std::size_t every) const {
  Eigen::Matrix<double, kColumns, kColumns> normal = Eigen::Matrix<double, kColumns, kColumns>::Zero();
  const double step_s = path.step_s;
  for (std::size_t i = std::max<std::size_t>(1, every / 2); i + 1 < path.joint_rad.size(); i += every) {
    const JointVector &before = path.joint_rad[i - 1], &at = path.joint_rad[i], &after = path.joint_rad[i + 1];
    const Rows rows =
        rows_at(kinematics_, arm_, at, (after - before) / (2 * step_s), (after - 2 * at + before) / (step_s * step_s));
    normal.noalias() += rows.transpose() * rows;
  }
  const int first = with_inertia_ ? 0 : kMomentX;  // the inertias come first
  const int columns = kColumns - first;
  const Eigen::VectorXd scale = normal.diagonal().tail(columns).cwiseSqrt();
  if (!(scale.minCoeff() > 0)) return std::numeric_limits<double>::infinity();
  const Eigen::MatrixXd scaled = scale.cwiseInverse().asDiagonal() * normal.bottomRightCorner(columns, columns) *
                                 scale.cwiseInverse().asDiagonal();
  const Eigen::VectorXd eigenvalues =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(scaled, Eigen::EigenvaluesOnly).eigenvalues();
  if (!(eigenvalues[0] > 0)) return std::numeric_limits<double>::infinity();
  return std::sqrt(eigenvalues[columns - 1] / eigenvalues[0]);
}

}  // namespace knuckle::estimation
