// An arm that stands, as the estimator tells it.
#pragma once

#include "estimation/joint_state.h"
#include "machine/kinematics.h"

namespace knuckle::slave {

/// Without pressures and forces.
inline estimation::JointState standing_at(const JointVector& pose_rad, const Kinematics& kinematics) {
  estimation::JointState state;
  state.angle_rad = pose_rad;
  for (int i = 0; i < kJoints; ++i) state.lever_m[i] = kinematics.cylinder_at(i, pose_rad[i]).value().lever_m;
  return state;
}

}  // namespace knuckle::slave
