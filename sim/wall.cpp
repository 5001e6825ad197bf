#include "sim/wall.h"

#include <algorithm>
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

/// The surface through which a place of the bucket has come in: the nearest; of what a corner of the wall has pushed
/// off by a side next to this place, the one which that side lies along.
std::size_t Wall::surface_entered(std::size_t place, const std::array<double, kSurfaces>& depth,
                                  const BucketMotion& bucket, const BucketOutline& outline) const noexcept {
  constexpr std::size_t face = kFace;
  for (std::size_t end = 0; end < kEnds; ++end) {
    const std::size_t side = ends_[end].surface;
    if (!ends_[end].touched || (side != place && (side + 1) % kCorners != place)) continue;
    if (ends_[end].slipped) return places_[place].surface;
    const PlanarVector in = -(bucket.turn * outline.outward(side));
    return in.dot(end_normal(end)) < in.dot(normal_) ? face : end_surface(end);
  }
  return static_cast<std::size_t>(std::min_element(depth.begin(), depth.end()) - depth.begin());
}

std::array<double, Wall::kSurfaces> Wall::depths_m(const PlanarVector& at_m) const noexcept {
  const PlanarVector offset = at_m - data_.point_m;
  const double sideways = offset.dot(along_);
  return {-offset.dot(normal_), sideways - data_.from_m, data_.to_m - sideways};
}

Wall::Touch Wall::touch_of_place(std::size_t place, const BucketMotion& bucket,
                                 const BucketOutline& outline) const noexcept {
  Touch touch;
  touch.at_m = outline.place(place, bucket);
  const std::array<double, kSurfaces> depth = depths_m(touch.at_m);
  if (*std::min_element(depth.begin(), depth.end()) <= 0 || depth[kFace] > data_.depth_m) return touch;
  // What has come in through a surface is pushed out through it.
  touch.surface = places_[place].touched ? places_[place].surface : surface_entered(place, depth, bucket, outline);
  touch.normal = touch.surface == kFace ? normal_ : end_normal(touch.surface - kFromEnd);
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
  const PlanarVector face = bucket.turn.back(normal_), end_face = bucket.turn.back(end_normal(end));
  std::size_t nearest = kCorners;
  for (std::size_t i = 0; i < kCorners; ++i) {
    if (outline.outward(i).dot(face) > kAlong || outline.outward(i).dot(end_face) > kAlong) continue;
    if (nearest == kCorners || outline.outside(i, in_bucket_m) > outline.outside(nearest, in_bucket_m)) nearest = i;
  }
  return nearest;
}

/// Whether a corner of the bucket that pressed on a surface has just gone past this corner of the wall.
bool Wall::slips_off(std::size_t end, const BucketMotion& bucket, const BucketOutline& outline) const noexcept {
  for (std::size_t i = 0; i < kCorners; ++i) {
    if (!places_[i].touched) continue;
    const std::array<double, kSurfaces> depth = depths_m(outline.place(i, bucket));
    if (places_[i].surface == kFace && depth[end_surface(end)] <= 0) return true;
    if (places_[i].surface == end_surface(end) && depth[kFace] <= 0) return true;
  }
  return false;
}

/// Whether a corner of the bucket next to this side is in the wall.
bool Wall::presses_beside(std::size_t side, const BucketMotion& bucket, const BucketOutline& outline) const noexcept {
  for (const std::size_t place : {side, (side + 1) % kCorners}) {
    if (touch_of_place(place, bucket, outline).depth_m > 0) return true;
  }
  return false;
}

/// Whether a corner of the wall lies past an end of this side, and that end past one of the surfaces and behind the
/// other: pressed in, a corner of the bucket slips off before the corner of the wall is within the outline.
bool Wall::leads_past(std::size_t side, const PlanarVector& in_bucket_m, std::size_t end, const BucketMotion& bucket,
                      const BucketOutline& outline) const noexcept {
  const bool before = (in_bucket_m - outline.corner(side)).dot(outline.along(side)) < 0;
  const PlanarVector offset = outline.place(before ? side : (side + 1) % kCorners, bucket) - end_m(end);
  return (offset.dot(normal_) > 0) != (offset.dot(end_normal(end)) > 0);
}

Wall::Touch Wall::touch_of_end(std::size_t end, const BucketMotion& bucket,
                               const BucketOutline& outline) const noexcept {
  Touch touch;
  touch.at_m = end_m(end);
  const PlanarVector in_bucket_m = bucket.turn.back(touch.at_m - bucket.pin_m);
  const std::size_t nearest = outline.nearest_side(in_bucket_m);
  const bool within = outline.outside(nearest, in_bucket_m) < 0;
  const bool slips = slips_off(end, bucket, outline);
  touch.slipped = slips || (ends_[end].touched && ends_[end].slipped);
  if (!within && !ends_[end].touched && !slips) return touch;
  touch.surface = ends_[end].touched ? ends_[end].surface : facing_side(end, in_bucket_m, bucket, outline);
  if (touch.surface == kCorners) return touch;
  // By a side further behind the corner pushes off only what has slipped off, and only while that is out of the wall.
  if (touch.surface != nearest && !ends_[end].touched && !slips) return touch;
  if (touch.surface != nearest && presses_beside(touch.surface, bucket, outline)) return touch;
  const double outside = outline.outside(touch.surface, in_bucket_m);
  if (outside >= 0 || (!within && !leads_past(touch.surface, in_bucket_m, end, bucket, outline))) return touch;
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
  if (!pair.touched) pair.slide.anchor_m = touch.slide_m;
  pair.touched = touch.depth_m > 0;
  if (!pair.touched) return 0;
  pair.surface = touch.surface;
  pair.slipped = touch.slipped;
  pair.slide.drag(touch.slide_m, data_.friction * normal);
  return normal;
}

double Wall::advance(const BucketMotion& bucket, const BucketOutline& outline, double dt) noexcept {
  std::array<Touch, kPlaces> of_places;
  std::array<Touch, kEnds> of_ends;
  if (!far(bucket, outline)) {
    for (std::size_t i = 0; i < kPlaces; ++i) of_places[i] = touch_of_place(i, bucket, outline);
    for (std::size_t i = 0; i < kEnds; ++i) {
      if (has_end_[i]) of_ends[i] = touch_of_end(i, bucket, outline);
    }
  }
  double pressed_N = 0;
  for (std::size_t i = 0; i < kPlaces; ++i) pressed_N += advance(places_[i], of_places[i]);
  for (std::size_t i = 0; i < kEnds; ++i) pressed_N += advance(ends_[i], of_ends[i]);
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
