#include "sim/wall.h"

#include <cmath>

namespace knuckle::sim {
namespace {

constexpr double kNear_m = 0.02;  // further than anything moves within a substep, or is pressed in where it slips off

}  // namespace

Wall::Wall(const WallDescription& description)
    : data_(description),
      normal_(description.normal.normalized()),
      along_(perp(normal_)),
      has_end_{std::isfinite(description.from_m), std::isfinite(description.to_m)} {}

bool Wall::far(const BucketMotion& bucket, const BucketOutline& outline) const noexcept {
  const PlanarVector offset = bucket.pin_m - data_.point_m;
  const double reach = outline.radius_m() + kNear_m;
  const double sideways = offset.dot(along_);
  return offset.dot(normal_) > reach || sideways < data_.from_m - reach || sideways > data_.to_m + reach;
}

double Wall::clearance_m(const BucketMotion& bucket, const BucketOutline& outline) const noexcept {
  if (far(bucket, outline)) return kNear_m;
  double clearance = kNear_m;
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const PlanarVector offset = outline.place(i, bucket) - data_.point_m;
    const double sideways = offset.dot(along_);
    clearance = std::min(clearance, std::max({offset.dot(normal_), data_.from_m - sideways, sideways - data_.to_m}));
  }
  for (std::size_t i = 0; i < kEnds; ++i) {
    if (!has_end_[i]) continue;
    const PlanarVector corner = bucket.turn.back(end_m(i) - bucket.pin_m);
    clearance = std::min(clearance, outline.outside(outline.nearest_side(corner), corner));
  }
  return clearance;
}

Wall::Touch Wall::touch_of_place(std::size_t place, const BucketMotion& bucket,
                                 const BucketOutline& outline) const noexcept {
  Touch touch;
  touch.at_m = outline.place(place, bucket);
  const PlanarVector offset = touch.at_m - data_.point_m;
  const double sideways = offset.dot(along_);
  const std::array<double, kSurfaces> depth{-offset.dot(normal_), sideways - data_.from_m, data_.to_m - sideways};
  if (depth[kFace] <= 0 || depth[kFace] > data_.depth_m || depth[kFromEnd] < 0 || depth[kToEnd] < 0) return touch;
  // What has come in through a surface is pushed out through it.
  touch.surface = kFace;
  if (places_[place].touched) {
    touch.surface = places_[place].surface;
  } else {
    for (const std::size_t end : {kFromEnd, kToEnd}) {
      if (depth[end] < depth[touch.surface]) touch.surface = end;
    }
  }
  touch.normal = touch.surface == kFace ? normal_ : touch.surface == kFromEnd ? PlanarVector(-along_) : along_;
  touch.along = perp(touch.normal);
  touch.depth_m = depth[touch.surface];
  const PlanarVector velocity = outline.velocity(place, bucket);
  touch.closing_mps = -velocity.dot(touch.normal);
  touch.slide_m = touch.at_m.dot(touch.along);
  touch.slide_mps = velocity.dot(touch.along);
  return touch;
}

/// The side of the bucket that a corner of the wall is least far behind, of those that face both surfaces which meet
/// there, or lie along one: pushed out by another, what slides off the end would hook behind it.
/// @return kCorners where there is none.
std::size_t Wall::facing_side(std::size_t end, const PlanarVector& in_bucket_m, const BucketMotion& bucket,
                              const BucketOutline& outline) const noexcept {
  constexpr double kAlong = 0.1;  // sine of the lean that still counts as along
  const PlanarVector face = bucket.turn.back(normal_), end_face = bucket.turn.back((end == 0 ? -1 : 1) * along_);
  std::size_t nearest = kCorners;
  for (std::size_t i = 0; i < kCorners; ++i) {
    if (outline.outward(i).dot(face) > kAlong || outline.outward(i).dot(end_face) > kAlong) continue;
    if (nearest == kCorners || outline.outside(i, in_bucket_m) > outline.outside(nearest, in_bucket_m)) nearest = i;
  }
  return nearest;
}

/// Whether a corner of the bucket that pressed on the face has just gone past this end.
bool Wall::slips_off(std::size_t end, const BucketMotion& bucket, const BucketOutline& outline) const noexcept {
  for (std::size_t i = 0; i < kCorners; ++i) {
    if (!places_[i].touched || places_[i].surface != kFace) continue;
    const double sideways = (outline.place(i, bucket) - data_.point_m).dot(along_);
    if (end == 0 ? sideways < data_.from_m : sideways > data_.to_m) return true;
  }
  return false;
}

Wall::Touch Wall::touch_of_end(std::size_t end, const BucketMotion& bucket,
                               const BucketOutline& outline) const noexcept {
  Touch touch;
  touch.at_m = end_m(end);
  const PlanarVector in_bucket_m = bucket.turn.back(touch.at_m - bucket.pin_m);
  const std::size_t nearest = outline.nearest_side(in_bucket_m);
  touch.within = outline.outside(nearest, in_bucket_m) < 0;
  // Where a tip that is pressed in slips off, the corner is behind the tip's side before it is within the outline.
  const bool slips = ends_[end].touched ? ends_[end].slipping : slips_off(end, bucket, outline);
  if (!touch.within && !slips) return touch;
  touch.surface = ends_[end].touched ? ends_[end].surface : facing_side(end, in_bucket_m, bucket, outline);
  // A side further behind takes the corner only once what is pressed into the face has left it.
  if (touch.surface == kCorners || (!ends_[end].touched && !slips && touch.surface != nearest)) return touch;
  const double outside = outline.outside(touch.surface, in_bucket_m);
  if (outside >= 0 || (!touch.within && !outline.is_beside(touch.surface, in_bucket_m, kNear_m))) return touch;
  touch.normal = -(bucket.turn * outline.outward(touch.surface));
  touch.along = bucket.turn * outline.along(touch.surface);
  touch.depth_m = -outside;
  const PlanarVector velocity = bucket.velocity(touch.at_m);
  touch.closing_mps = -velocity.dot(touch.normal);
  touch.slide_m = -(in_bucket_m - outline.corner(touch.surface)).dot(outline.along(touch.surface));
  touch.slide_mps = velocity.dot(touch.along);
  return touch;
}

double Wall::normal_force(const Pair& pair, const Touch& touch) const noexcept {
  if (touch.depth_m <= 0) return 0;
  if (data_.hunt_crossley_N_per_m15 > 0) {
    const double spring = data_.hunt_crossley_N_per_m15 * touch.depth_m * std::sqrt(touch.depth_m);
    return std::max(0.0, spring * (1 + 1.5 * data_.hunt_crossley_loss_s_per_m * touch.closing_mps));
  }
  return std::max(0.0, data_.stiffness_N_per_m * touch.depth_m + pair.damping_Ns_per_m * touch.closing_mps);
}

PlanarVector Wall::force(const Pair& pair, const Touch& touch) const noexcept {
  const double normal = normal_force(pair, touch);
  Bristle slide = pair.slide;
  if (!pair.touched) slide.anchor_m = touch.slide_m;
  return normal * touch.normal + slide.force(touch.slide_m, touch.slide_mps, data_.friction * normal) * touch.along;
}

void Wall::add_forces(const BucketMotion& bucket, const BucketOutline& outline, ContactForces& forces) const noexcept {
  if (far(bucket, outline)) return;
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const Touch touch = touch_of_place(i, bucket, outline);
    if (touch.depth_m <= 0) continue;
    forces.on_place(&ContactForces::wall, bucket, i, touch.at_m, force(places_[i], touch));
  }
  for (std::size_t i = 0; i < kEnds; ++i) {
    if (!has_end_[i]) continue;
    const Touch touch = touch_of_end(i, bucket, outline);
    if (touch.depth_m > 0) forces.on_bucket(&ContactForces::wall, bucket, touch.at_m, force(ends_[i], touch));
  }
}

double Wall::advance(Pair& pair, const Touch& touch) const noexcept {
  const double normal = normal_force(pair, touch);
  const bool fresh = !pair.touched;
  pair.touched = touch.depth_m > 0;
  if (!pair.touched) return 0;
  pair.surface = touch.surface;
  pair.slipping = !touch.within && (fresh || pair.slipping);
  if (fresh) pair.slide.anchor_m = touch.slide_m;
  pair.slide.drag(touch.slide_m, data_.friction * normal);
  return normal;
}

double Wall::advance(const BucketMotion& bucket, const BucketOutline& outline, double dt) noexcept {
  double pressed_N = 0;
  const bool away = far(bucket, outline);
  for (std::size_t i = 0; i < kEnds; ++i) {  // first: they take over what slips off
    if (away || !has_end_[i]) {
      ends_[i].touched = false;
    } else {
      pressed_N += advance(ends_[i], touch_of_end(i, bucket, outline));
    }
  }
  for (std::size_t i = 0; i < kPlaces; ++i) {
    if (away) {
      places_[i].touched = false;
    } else {
      pressed_N += advance(places_[i], touch_of_place(i, bucket, outline));
    }
  }
  if (broken_ || data_.break_force_N <= 0) return 0;
  damage_Ns_ += std::max(0.0, pressed_N - data_.break_force_N) * dt;
  if (damage_Ns_ < data_.break_impulse_Ns) return 0;
  broken_ = true;
  data_.point_m -= data_.piece_depth_m * normal_;
  for (Pair& pair : places_) pair.touched = false;
  for (Pair& pair : ends_) pair.touched = false;
  return pressed_N;
}

double Wall::damping(double inverse_mass_1pkg) const noexcept {
  return 2 * data_.damping_ratio * std::sqrt(data_.stiffness_N_per_m / inverse_mass_1pkg);
}

void Wall::set_mobility(const Mobility& mobility, const BucketMotion& bucket, const BucketOutline& outline) noexcept {
  if (far(bucket, outline)) return;
  const auto inverse_mass = [&](const PlanarVector& at_m, const PlanarVector& normal) {
    const Eigen::Vector3d wrench(normal.x(), normal.y(), cross(at_m - bucket.pin_m, normal));
    return wrench.dot(mobility * wrench);
  };
  // A surface first touched within this tick is damped as the face is: the effective mass is of the same order.
  for (std::size_t i = 0; i < kPlaces; ++i) {
    if (!places_[i].touched) places_[i].damping_Ns_per_m = damping(inverse_mass(outline.place(i, bucket), normal_));
  }
  for (std::size_t i = 0; i < kEnds; ++i) {
    if (!ends_[i].touched) ends_[i].damping_Ns_per_m = damping(inverse_mass(end_m(i), normal_));
  }
}

}  // namespace knuckle::sim
