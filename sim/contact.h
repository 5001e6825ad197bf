// What a contact is made of: an elastic bristle for friction, and forces collected into a wrench on the bucket.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>

#include "core/joints.h"
#include "machine/description_fwd.h"
#include "sim/linkage.h"
#include "sim/world.h"

namespace knuckle::sim {

// The bucket as the world meets it: a convex outline that moves, and the linkage's pin behind it.

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

/// A spring to an anchor that is dragged along where the force would pass its limit: sticks, then slides, at any speed
/// without the stiffness of a regularised sign.
struct Bristle {
  double stiffness_N_per_m, damping_Ns_per_m;
  double anchor_m = 0;
  [[nodiscard]] double force(double at_m, double rate_mps, double limit_N) const noexcept {
    return std::clamp(-stiffness_N_per_m * (at_m - anchor_m) - damping_Ns_per_m * rate_mps, -limit_N, limit_N);
  }
  void drag(double at_m, double limit_N) noexcept {
    const double stretch = limit_N / stiffness_N_per_m;
    anchor_m = std::clamp(anchor_m, at_m - stretch, at_m + stretch);
  }
};

/// Forces of the world on the machine, frame W.
struct ContactForces {
  // By cause; ground is a wall.
  PlanarVector wall = PlanarVector::Zero(), soil = PlanarVector::Zero(), pipe = PlanarVector::Zero(),
               piece = PlanarVector::Zero();
  PlanarVector bucket_N = PlanarVector::Zero();     ///< All on the bucket,
  double bucket_Nm = 0;                             ///< and their moment about the bucket pin.
  PlanarVector linkage_N = PlanarVector::Zero();    ///< On the pin between rocker and coupler.
  double weight_N = 0;                              ///< Sum of the forces' norms,
  PlanarVector weighted_Nm = PlanarVector::Zero();  ///< and of the norms times where they act, from the bucket pin.

  [[nodiscard]] PlanarVector sum() const noexcept { return bucket_N + linkage_N; }
  /// Mechanical power of the world on the machine.
  [[nodiscard]] double power_W(const BucketMotion& bucket) const noexcept {
    return bucket_N.dot(bucket.pin_mps) + bucket_Nm * bucket.rate_radps + linkage_N.dot(bucket.linkage_mps);
  }
  /// @param cause nullptr: a test rig.
  void on_bucket(PlanarVector ContactForces::*cause, const BucketMotion& bucket, const PlanarVector& at_m,
                 const PlanarVector& force_N) noexcept {
    bucket_N += force_N;
    bucket_Nm += cross(at_m - bucket.pin_m, force_N);
    count(cause, bucket, at_m, force_N);
  }
  void on_linkage(PlanarVector ContactForces::*cause, const BucketMotion& bucket,
                  const PlanarVector& force_N) noexcept {
    linkage_N += force_N;
    count(cause, bucket, bucket.linkage_m, force_N);
  }
  /// On a corner of the outline or on the linkage's pin.
  void on_place(PlanarVector ContactForces::*cause, const BucketMotion& bucket, std::size_t place,
                const PlanarVector& at_m, const PlanarVector& force_N) noexcept {
    if (place < kCorners)
      on_bucket(cause, bucket, at_m, force_N);
    else
      on_linkage(cause, bucket, force_N);
  }

 private:
  void count(PlanarVector ContactForces::*cause, const BucketMotion& bucket, const PlanarVector& at_m,
             const PlanarVector& force_N) noexcept {
    if (cause != nullptr) this->*cause += force_N;
    const double norm_N = force_N.norm();
    weight_N += norm_N;
    weighted_Nm += norm_N * (at_m - bucket.pin_m);
  }
};

/// How the bucket answers a force (x, z) and a moment at its pin, frame W: accelerations of pin and angle.
using Mobility = Eigen::Matrix3d;

// A running wall: a face, and ends where it has any, against every corner of the bucket; its own corners against every
// side of the bucket. It breaks by the forces it takes.

class Wall {
 public:
  explicit Wall(const WallDescription& description);

  /// Adds what the bucket feels of this wall.
  void add_forces(const BucketMotion& bucket, const BucketOutline& outline, ContactForces& forces) const noexcept;
  /// Moves friction's anchors and the damage after a substep. @return the force by which the piece has just broken
  /// loose, else 0 [N].
  double advance(const BucketMotion& bucket, const BucketOutline& outline, double dt) noexcept;
  /// Damping of what will be touched next.
  void set_mobility(const Mobility& mobility, const BucketMotion& bucket, const BucketOutline& outline) noexcept;
  /// A lower bound of how far the bucket is from it, negative inside.
  [[nodiscard]] double clearance_m(const BucketMotion& bucket, const BucketOutline& outline) const noexcept;
  [[nodiscard]] const WallDescription& data() const noexcept { return data_; }

 private:
  /// Surfaces of the wall: the face, the end at from_m, the end at to_m.
  enum Surface : std::uint8_t { kFace, kFromEnd, kToEnd, kSurfaces };
  static constexpr std::size_t kEnds = 2;

  /// A place of the bucket in the wall, or a corner of the wall in the bucket.
  struct Pair {
    bool touched = false;
    std::size_t surface = 0;        ///< By which it came in: of the wall, or side of the bucket.
    std::size_t slipped = kPlaces;  ///< Of a corner of the wall: what has slipped off there since it touches.
    double damping_Ns_per_m = 0;
    Bristle slide{2e6, 4e3};
  };
  /// One contact now. The normal points onto the bucket.
  struct Touch {
    std::size_t surface = 0;
    std::size_t slipped = kPlaces;
    PlanarVector at_m, normal, along;
    double depth_m = 0, closing_mps = 0;  ///< Depth 0: no contact.
    double slide_m = 0, slide_mps = 0;    ///< Of the bucket along the wall.
  };
  [[nodiscard]] bool far(const BucketMotion& bucket, const BucketOutline& outline) const noexcept;
  /// Of a point behind each surface, negative outside.
  [[nodiscard]] std::array<double, kSurfaces> depths_m(const PlanarVector& at_m) const noexcept;
  [[nodiscard]] Touch touch_of_place(std::size_t place, const BucketMotion& bucket,
                                     const BucketOutline& outline) const noexcept;
  [[nodiscard]] Touch touch_of_end(std::size_t end, const BucketMotion& bucket,
                                   const BucketOutline& outline) const noexcept;
  [[nodiscard]] bool faces(std::size_t side, std::size_t end, double lean, const BucketMotion& bucket,
                           const BucketOutline& outline) const noexcept;
  [[nodiscard]] std::size_t facing_side(std::size_t end, std::size_t next_to, const PlanarVector& in_bucket_m,
                                        const BucketMotion& bucket, const BucketOutline& outline) const noexcept;
  [[nodiscard]] std::size_t surface_entered(std::size_t place, const std::array<double, kSurfaces>& depth,
                                            const BucketMotion& bucket, const BucketOutline& outline) const noexcept;
  [[nodiscard]] std::size_t slips_off(std::size_t end, const BucketMotion& bucket,
                                      const BucketOutline& outline) const noexcept;
  [[nodiscard]] bool is_past(std::size_t place, std::size_t end, const BucketMotion& bucket,
                             const BucketOutline& outline) const noexcept;
  [[nodiscard]] double normal_force(const Pair& pair, const Touch& touch) const noexcept;
  [[nodiscard]] PlanarVector force(const Pair& pair, const Touch& touch) const noexcept;
  [[nodiscard]] double advance(Pair& pair, const Touch& touch) const noexcept;
  [[nodiscard]] double damping(double inverse_mass_1pkg) const noexcept;
  [[nodiscard]] PlanarVector end_m(std::size_t end) const noexcept {
    return data_.point_m + (end == 0 ? data_.from_m : data_.to_m) * along_;
  }
  [[nodiscard]] PlanarVector end_normal(std::size_t end) const noexcept {
    return end == 0 ? PlanarVector(-along_) : along_;
  }
  [[nodiscard]] static std::size_t end_surface(std::size_t end) noexcept { return end == 0 ? kFromEnd : kToEnd; }

  WallDescription data_;
  PlanarVector normal_, along_;
  std::array<bool, kEnds> has_end_;
  std::array<Pair, kPlaces> places_{};
  std::array<Pair, kEnds> ends_{};
  double damage_Ns_ = 0;
  bool broken_ = false;
};

}  // namespace knuckle::sim
