// The three joints, in the one order used by every array: boom, arm, bucket.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

namespace knuckle {

inline constexpr int kJoints = 3;
inline constexpr int kBoom = 0;
inline constexpr int kArm = 1;
inline constexpr int kBucket = 2;
inline constexpr std::array<const char*, kJoints> kJointNames{"boom", "arm", "bucket"};

using JointVector = Eigen::Vector3d;   ///< One value per joint or cylinder.
using PlanarVector = Eigen::Vector2d;  ///< (x forward, z up) in the arm's plane.
template <typename T>
using PerJoint = std::array<T, kJoints>;

}  // namespace knuckle
