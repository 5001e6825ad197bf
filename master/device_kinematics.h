// Planar 3R kinematics at hand scale: the haptic device has the machine's shape, so machine joint angles put through it
// give the machine's tip as the hand would hold it.
#pragma once

#include <cmath>

#include "core/joints.h"
#include "machine/planar_jacobian.h"

namespace knuckle::master {

/// Where the tip is and how joints move it, frame D (as M, origin at the forearm joint).
struct DevicePosture {
  PlanarVector tip_m = PlanarVector::Zero();
  PlanarJacobian jacobian =
      PlanarJacobian::Zero();  ///< d tip / d joints [m/rad]; joint torque of a tip force f is J^T f.
};

class DeviceKinematics {
 public:
  /// @param link_m lengths of forearm, hand and finger.
  explicit DeviceKinematics(const JointVector& link_m) noexcept : link_m_(link_m) {}

  [[nodiscard]] DevicePosture posture(const JointVector& joint_rad) const noexcept {
    PerJoint<PlanarVector> link;
    double absolute_rad = 0;
    for (std::size_t i = 0; i < kJoints; ++i) {
      absolute_rad += joint_rad[static_cast<Eigen::Index>(i)];
      link[i] = link_m_[static_cast<Eigen::Index>(i)] * PlanarVector(std::cos(absolute_rad), std::sin(absolute_rad));
    }
    DevicePosture posture;
    for (std::size_t i = kJoints; i-- > 0;) {  // joint i turns everything from its own axis to the tip
      posture.tip_m += link[i];
      posture.jacobian.col(static_cast<Eigen::Index>(i)) = PlanarVector(-posture.tip_m.y(), posture.tip_m.x());
    }
    return posture;
  }

 private:
  JointVector link_m_;
};

/// The tip force that explains joint torques best: least squares over three torques, (J J^T)^-1 J tau. Damped where
/// the arm is straight (1e-5 m^2 against about 0.1 m^2), as torques do not determine a tip force along it.
[[nodiscard]] inline PlanarVector tip_force_of(const PlanarJacobian& jacobian, const JointVector& torque_Nm) noexcept {
  return PlanarInverse(jacobian, JointVector::Ones(), 1e-5).force_N(torque_Nm);
}

}  // namespace knuckle::master
