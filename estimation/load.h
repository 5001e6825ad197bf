// What a load in the bucket asks of the joints: columns of gravity torque for its mass and first moments.
#pragma once

#include <Eigen/Dense>

#include "core/joints.h"
#include "estimation/regressor.h"

namespace knuckle::estimation {

/// (m [kg], m x, m z [kg m]), place in bucket axes.
using Load = Eigen::Vector3d;

/// Torques of a load on the joints are columns * load:
///   tau_bucket = -g (m x cos phi_3 - m z sin phi_3),  tau_arm = tau_bucket - g m l_arm cos phi_2,
///   tau_boom = tau_arm - g m l_boom cos phi_1.
[[nodiscard]] inline Eigen::Matrix3d load_columns(const JointVector& length_m, const Pose& pose) noexcept {
  Eigen::Matrix3d columns;
  Eigen::RowVector3d row(0, -kGravity_mps2 * pose.cos[kBucket], kGravity_mps2 * pose.sin[kBucket]);
  for (int i = kBucket; i >= 0; --i) {
    if (i < kBucket) row[0] -= kGravity_mps2 * length_m[i] * pose.cos[i];
    columns.row(i) = row;
  }
  return columns;
}

}  // namespace knuckle::estimation
