// What the papers' methods share: when to refuse data, and the tip force that explains joint torques as they take it:
// no weights, no prior, no history.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "core/joints.h"
#include "estimation/identification/identification.h"
#include "estimation/identification/motion.h"
#include "machine/kinematics.h"

namespace knuckle::estimation {

/// What forbids identification before it is tried, each one line: too short, pressures that never change, joints that
/// hardly move. Joints before `first` are not looked at. Empty: go on.
[[nodiscard]] std::vector<std::string> unfit(std::span<const Motion> motions, int first, double least_s,
                                             double least_span_rad);

/// Torques of the cylinders on the relative joints, r F.
[[nodiscard]] inline JointVector cylinder_torque(const Motion& motion, Eigen::Index sample) {
  return motion.lever_m.col(sample).cwiseProduct(motion.cylinder_N.col(sample));
}

/// A comparison of so many samples, nothing usable yet.
[[nodiscard]] TorqueComparison empty_comparison(const Motion& motion);

/// Below it two links count as one straight one: a few N m of torque error would be a large force.
inline constexpr double kStraightSine = 0.2;

/// Torques of the world on arm and bucket joint -> force on the tip, from these two equations alone (M: two cylinders).
/// @param jacobian d tip / d joints; @param torque_Nm its boom entry is not used.
/// @return NaN where the bucket is in line with the arm: nothing along that line reaches either joint.
[[nodiscard]] PlanarVector force_of_two_joints(const Eigen::Matrix<double, 2, 3>& jacobian,
                                               const JointVector& joints_rad, const JointVector& torque_Nm);

/// Three torques -> two unknowns, ordinary least squares.
[[nodiscard]] PlanarVector force_of_three_joints(const Eigen::Matrix<double, 2, 3>& jacobian,
                                                 const JointVector& joints_rad, const JointVector& torque_Nm);

/// Three torques -> (Fx, Fz [N], torque about the tip [N m]) by matrix inversion (K, figure 8).
/// @return NaN where the arm is in line with the boom: the determinant is l1 l2 sin(arm).
[[nodiscard]] Eigen::Vector3d wrench_of_three_joints(const Eigen::Matrix<double, 2, 3>& jacobian,
                                                     const JointVector& joints_rad, const JointVector& torque_Nm);

/// Torque of the world on the joints is what the model asks for and the cylinders did not give.
/// @param solve one of the three above. @return one answer a sample, NaN where the comparison is not usable.
template <typename Solve>
[[nodiscard]] auto solve_each(const MachineDescription& machine, const Motion& motion, const TorqueComparison& torque,
                              Solve solve) {
  const Kinematics kinematics(machine);
  using Answer = decltype(solve({}, {}, {}));
  std::vector<Answer> answers(torque.usable.size(), Answer::Constant(std::numeric_limits<double>::quiet_NaN()));
  for (std::size_t i = 0; i < answers.size(); ++i) {
    if (torque.usable[i] == 0) continue;
    const JointVector joints = motion.joint_rad.col(static_cast<Eigen::Index>(i));
    answers[i] = solve(kinematics.tip_jacobian(joints), joints, torque.modelled_Nm[i] - torque.measured_Nm[i]);
  }
  return answers;
}

}  // namespace knuckle::estimation
