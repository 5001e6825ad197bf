// Where on the bucket a force acts: its line of action, and on which sides of the bucket's outline it may push.
#pragma once

#include <array>
#include <cstddef>

#include "core/joints.h"
#include "estimation/tip_force.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

/// Sides of bucket_outline(), counter-clockwise from the tip: teeth (tip to edge), floor, back, the linkage's side, and
/// the side plates' edge in two parts.
inline constexpr std::array kBucketSideNames{"teeth", "floor", "back", "linkage", "cheek", "mouth"};
inline constexpr std::size_t kBucketSides = kBucketSideNames.size();

/// Passes the tip at offset_m, measured at right angles to the force, positive to its left: torque about the tip =
/// -offset * |force|. Both 0 where the force is too small to have a line.
struct LineOfAction {
  double offset_m = 0, sigma_m = 0;
};
[[nodiscard]] LineOfAction line_of_action(const BucketLoad& load) noexcept;

class TouchedSides {
 public:
  explicit TouchedSides(const MachineDescription& machine) noexcept;
  /// A line meets a convex outline twice: where it comes in, the world pushes on the bucket; where it goes out it could
  /// only pull, as something hooked does. One that passes the outline by touches no side: then the shares sum up to
  /// less than 1, and to 0 for a force too small to have a line.
  /// @return probability of each side, by the line's offset and direction with their uncertainty (first order).
  [[nodiscard]] std::array<double, kBucketSides> shares(const JointVector& joints_rad,
                                                        const BucketLoad& load) const noexcept;

 private:
  std::array<PlanarVector, kBucketSides> corners_from_tip_m_{};  ///< Bucket axes.
};

}  // namespace knuckle::estimation
