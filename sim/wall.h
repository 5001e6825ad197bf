// A running wall: a face, and ends where it has any, against every corner of the bucket; its own corners against every
// side of the bucket. It breaks by the forces it takes.
#pragma once

#include <array>

#include "sim/contact.h"
#include "sim/world.h"

namespace knuckle::sim {

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
