// The machine as rigid bodies, shaped by the machine file alone, and where each of them is in a pose.
#pragma once

#include <array>
#include <cstdint>

#include "app/console/picture/mesh.h"
#include "core/joints.h"
#include "machine/description_fwd.h"
#include "machine/kinematics.h"

namespace knuckle::console::picture {

/// The bodies that move with the joints. Axes: links as in the machine file; rocker from J to H and coupler from H to K
/// along x; barrels from the base pin and rods from the rod end's pin, both with x along the cylinder.
enum class Body : std::uint8_t {
  kBoom,
  kArm,
  kBucket,
  kRocker,
  kCoupler,
  kBoomBarrel,
  kArmBarrel,
  kBucketBarrel,
  kBoomRod,
  kArmRod,
  kBucketRod,
};
inline constexpr std::size_t kBodies = 11;

/// In the bodies' own axes.
[[nodiscard]] std::array<Mesh, kBodies> body_meshes(const MachineDescription& machine);

/// The room in the bucket that a load fills, in the bucket's axes: from the hinge round the back to the cutting edge,
/// and across its mouth.
[[nodiscard]] Outline bucket_room(const MachineDescription& machine);

/// Of the bodies' axes, frame M.
[[nodiscard]] std::array<Frame2, kBodies> body_frames(const MachinePose& pose);

/// Two balls that the simulated machine has on the left of its bucket, as surveyors put targets on: programs that watch
/// the picture find the bucket by them.
struct TargetBalls {
  std::array<Eigen::Vector3d, 2> at_m;  ///< Bucket axes, y to the left: near the bucket's pin, near the teeth.
  double radius_m = 0;
};
[[nodiscard]] TargetBalls target_balls(const MachineDescription& machine);

/// What stands on the ground, frame M: tracks, cab and the boom's bracket. The description says nothing of them but
/// where the boom and its cylinder are held.
[[nodiscard]] Mesh hull_mesh(const MachineDescription& machine, double ground_m);

}  // namespace knuckle::console::picture
