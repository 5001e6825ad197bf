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
/// a_x b_z - a_z b_x: with a an arm and b a force, its torque, positive from x to z.
[[nodiscard]] inline double cross(const PlanarVector& a, const PlanarVector& b) noexcept {
  return a.x() * b.y() - a.y() * b.x();
}
template <typename T>
using PerJoint = std::array<T, kJoints>;

}  // namespace knuckle
