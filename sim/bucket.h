// The bucket as the world meets it: a convex outline that moves, and the linkage's pin behind it.
#pragma once

#include <array>
#include <cstdint>

#include "core/joints.h"
#include "machine/description_fwd.h"
#include "sim/linkage.h"

namespace knuckle::sim {

/// Corners of the outline in order, counter-clockwise; then the pin between rocker and coupler, which moves by itself.
enum class BucketPlace : std::uint8_t { kTip, kEdge, kHeel, kBack, kPin, kCheek, kLinkage };
inline constexpr std::size_t kCorners = 6;
inline constexpr std::size_t kPlaces = 7;
[[nodiscard]] const char* name(BucketPlace place) noexcept;  ///< "tip", "heel", ...

/// How the bucket moves, frame W.
struct BucketMotion {
  PlanarVector pin_m = PlanarVector::Zero(), pin_mps = PlanarVector::Zero();  ///< Origin of the bucket's axes.
  Turn turn;                                                                  ///< Bucket axes to W.
  double rate_radps = 0;
  double angle_rad = 0;  ///< Of pin to tip to the horizontal, not wrapped.
  PlanarVector linkage_m = PlanarVector::Zero(), linkage_mps = PlanarVector::Zero();  ///< Pin of rocker and coupler.

  [[nodiscard]] PlanarVector at(const PlanarVector& of_bucket_m) const noexcept { return pin_m + turn * of_bucket_m; }
  /// Velocity of the bucket's material at a point of W.
  [[nodiscard]] PlanarVector velocity(const PlanarVector& at_m) const noexcept {
    return pin_mps + rate_radps * perp(at_m - pin_m);
  }
};

/// The true outline, bucket axes.
class BucketOutline {
 public:
  explicit BucketOutline(const MachineDescription& machine);

  [[nodiscard]] const PlanarVector& corner(std::size_t i) const noexcept { return corners_[i]; }
  [[nodiscard]] const PlanarVector& tip() const noexcept { return corners_[0]; }
  /// Where a corner or the linkage's pin is, frame W.
  [[nodiscard]] PlanarVector place(std::size_t i, const BucketMotion& bucket) const noexcept {
    return i < kCorners ? bucket.at(corners_[i]) : bucket.linkage_m;
  }
  [[nodiscard]] PlanarVector velocity(std::size_t i, const BucketMotion& bucket) const noexcept {
    return i < kCorners ? bucket.velocity(bucket.at(corners_[i])) : bucket.linkage_mps;
  }
  /// Side i runs from corner i to the next. Outward normal and the direction of the run, bucket axes.
  [[nodiscard]] const PlanarVector& outward(std::size_t side) const noexcept { return outward_[side]; }
  [[nodiscard]] const PlanarVector& along(std::size_t side) const noexcept { return along_[side]; }
  /// Distance of a point outside the line of a side, negative inside; bucket axes.
  [[nodiscard]] double outside(std::size_t side, const PlanarVector& at_m) const noexcept {
    return (at_m - corners_[side]).dot(outward_[side]);
  }
  /// The corner at that end of a side which is nearer to a point.
  [[nodiscard]] std::size_t nearer_corner(std::size_t side, const PlanarVector& at_m) const noexcept {
    const bool first = (at_m - corners_[side]).dot(along_[side]) < 0.5 * length_m_[side];
    return first ? side : (side + 1) % kCorners;
  }
  /// The side that a point is furthest outside of, or, inside the outline, least far behind.
  [[nodiscard]] std::size_t nearest_side(const PlanarVector& at_m) const noexcept;
  /// The outline's point nearest to a point, both in bucket axes.
  [[nodiscard]] PlanarVector nearest(const PlanarVector& at_m) const noexcept;
  /// A circle about the bucket pin that holds outline and linkage.
  [[nodiscard]] double radius_m() const noexcept { return radius_m_; }

 private:
  std::array<PlanarVector, kCorners> corners_, outward_, along_;
  std::array<double, kCorners> length_m_{};
  double radius_m_ = 0;
};

}  // namespace knuckle::sim
