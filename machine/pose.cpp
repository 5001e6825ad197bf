#include "machine/pose.h"

#include <algorithm>
#include <cmath>

#include "machine/description.h"

namespace knuckle {
namespace {

Frame2 joint_frame(const Frame2& parent, const PlanarVector& origin_m, double angle_rad) {
  return parent * Eigen::Translation2d(origin_m) * Eigen::Rotation2Dd(angle_rad);
}

/// H of the bucket linkage: |HJ| and |HK| from J and K, on the given side of the ray from J to K.
PlanarVector linkage_joint(const BucketLinkage& linkage, const PlanarVector& j, const PlanarVector& k) {
  const PlanarVector ray = k - j;
  const double d = ray.norm();
  const double along = (linkage.rocker_length_m * linkage.rocker_length_m -
                        linkage.coupler_length_m * linkage.coupler_length_m + d * d) /
                       (2 * d);
  const double aside = std::sqrt(std::max(0.0, linkage.rocker_length_m * linkage.rocker_length_m - along * along));
  const PlanarVector left(-ray.y(), ray.x());
  return j + (along * ray + linkage.branch * aside * left) / d;
}

}  // namespace

MachinePose pose_of(const MachineDescription& m, const JointVector& q) {
  MachinePose pose;
  pose.boom = joint_frame(Frame2::Identity(), PlanarVector::Zero(), q[kBoom]);
  pose.arm = joint_frame(pose.boom, {m.links[kBoom].length_m, 0}, q[kArm]);
  pose.bucket = joint_frame(pose.arm, {m.links[kArm].length_m, 0}, q[kBucket]);
  pose.rocker_pin_m = pose.arm * m.bucket_linkage.rocker_pin_m;
  pose.bucket_pin_m = pose.bucket * m.bucket_linkage.bucket_pin_m;
  pose.linkage_pin_m = linkage_joint(m.bucket_linkage, pose.rocker_pin_m, pose.bucket_pin_m);
  pose.cylinders[kBoom] = {m.boom_mount.parent_pin_m, pose.boom * m.boom_mount.child_pin_m};
  pose.cylinders[kArm] = {pose.boom * m.arm_mount.parent_pin_m, pose.arm * m.arm_mount.child_pin_m};
  pose.cylinders[kBucket] = {pose.arm * m.bucket_linkage.cylinder_pin_m, pose.linkage_pin_m};
  pose.tip_m = pose.bucket * PlanarVector(m.links[kBucket].length_m, 0);
  return pose;
}

double barrel_length_m(const CylinderDescription& cylinder, double length_m) {
  return std::min(cylinder.min_length_m * 0.86, length_m * 0.95);
}

std::array<PlanarVector, 6> bucket_outline(const MachineDescription& machine) {
  const BucketProfile& profile = machine.bucket_profile;
  return {PlanarVector(machine.links[kBucket].length_m, 0),
          profile.edge_m,
          profile.heel_m,
          profile.back_m,
          PlanarVector(PlanarVector::Zero()),
          profile.cheek_m};
}

JointVector middle_of_range(const MachineDescription& machine) noexcept {
  JointVector middle;
  for (int i = 0; i < kJoints; ++i) {
    const LinkDescription& link = machine.links[static_cast<std::size_t>(i)];
    middle[i] = 0.5 * (link.min_rad + link.max_rad);
  }
  return middle;
}

}  // namespace knuckle
