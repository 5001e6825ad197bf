#include "estimation/identification/baseline.h"

#include <numbers>
#include <sstream>

namespace knuckle::estimation {
namespace {

struct Span {
  JointVector low = JointVector::Constant(std::numeric_limits<double>::infinity()), high = -low;
  void add(const JointVector& value) {
    low = low.cwiseMin(value);
    high = high.cwiseMax(value);
  }
};

}  // namespace

std::vector<std::string> unfit(std::span<const Motion> motions, int first, double least_s, double least_span_rad) {
  constexpr double kDegPerRad = 180 / std::numbers::pi;
  std::vector<std::string> reasons;
  const auto say = [&](auto&&... parts) {
    std::ostringstream line;
    line.precision(3);
    (line << ... << parts);
    reasons.push_back(line.str());
  };
  Span angle, force;
  double usable_s = 0;
  for (const Motion& motion : motions) {
    usable_s += motion.duration_s();
    for (const Stretch& stretch : motion.stretches) {
      for (Eigen::Index i = stretch.first; i < stretch.end; ++i) {
        angle.add(motion.joint_rad.col(i));
        force.add(motion.cylinder_N.col(i));
      }
    }
  }
  if (usable_s < least_s) say(usable_s, " s of usable data; at least ", least_s, " s are needed");
  for (int i = first; usable_s > 0 && i < kJoints; ++i) {
    const char* joint = kJointNames[static_cast<std::size_t>(i)];
    const double span_rad = angle.high[i] - angle.low[i];
    if (span_rad < least_span_rad)
      say(joint, " moved over ", span_rad * kDegPerRad, " deg; at least ", least_span_rad * kDegPerRad, " are needed");
    if (!(force.high[i] > force.low[i])) say(joint, " pressures never change: ", force.low[i], " N all the time");
  }
  return reasons;
}

TorqueComparison empty_comparison(const Motion& motion) {
  const auto size = static_cast<std::size_t>(motion.size());
  const JointVector unknown = JointVector::Constant(std::numeric_limits<double>::quiet_NaN());
  return {motion.step_s, std::vector<JointVector>(size, unknown), std::vector<JointVector>(size, unknown),
          std::vector<std::uint8_t>(size, 0)};
}

PlanarVector force_of_two_joints(const PlanarJacobian& jacobian, const JointVector& joints_rad,
                                 const JointVector& torque_Nm) {
  if (std::abs(std::sin(joints_rad[kBucket])) < kStraightSine)
    return PlanarVector::Constant(std::numeric_limits<double>::quiet_NaN());
  const Eigen::Matrix2d two = jacobian.rightCols<2>().transpose();
  return two.inverse() * torque_Nm.tail<2>();
}

PlanarVector force_of_three_joints(const PlanarJacobian& jacobian, const JointVector&, const JointVector& torque_Nm) {
  return PlanarInverse(jacobian, JointVector::Ones(), 0).force_N(torque_Nm);
}

Eigen::Vector3d wrench_of_three_joints(const PlanarJacobian& jacobian, const JointVector& joints_rad,
                                       const JointVector& torque_Nm) {
  if (std::abs(std::sin(joints_rad[kArm])) < kStraightSine)
    return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  Eigen::Matrix3d three;
  three << jacobian, Eigen::RowVector3d::Ones();
  return three.transpose().inverse() * torque_Nm;
}

}  // namespace knuckle::estimation
