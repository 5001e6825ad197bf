#include "estimation/identification/baseline.h"

#include <fmt/format.h>

#include <numbers>

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
  if (usable_s < least_s)
    reasons.push_back(fmt::format("{:.3g} s of usable data; at least {:.3g} s are needed", usable_s, least_s));
  for (int i = first; usable_s > 0 && i < kJoints; ++i) {
    const char* joint = kJointNames[static_cast<std::size_t>(i)];
    const double span_rad = angle.high[i] - angle.low[i];
    if (span_rad < least_span_rad)
      reasons.push_back(fmt::format("{} moved over {:.3g} deg; at least {:.3g} are needed", joint,
                                    span_rad * kDegPerRad, least_span_rad * kDegPerRad));
    if (!(force.high[i] > force.low[i]))
      reasons.push_back(fmt::format("{} pressures never change: {:.3g} N all the time", joint, force.low[i]));
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
