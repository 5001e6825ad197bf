#include "sim/contact.h"

#include <cmath>

#include "machine/description.h"

namespace knuckle::sim {

const char* name(BucketPlace place) noexcept {
  constexpr std::array<const char*, kPlaces> kNames{"tip", "edge", "heel", "back", "pin", "cheek", "linkage"};
  return kNames[static_cast<std::size_t>(place)];
}

BucketOutline::BucketOutline(const MachineDescription& machine) {
  const BucketProfile& profile = machine.bucket_profile;
  corners_ = {PlanarVector(machine.links[kBucket].length_m, 0),
              profile.edge_m,
              profile.heel_m,
              profile.back_m,
              PlanarVector(PlanarVector::Zero()),
              profile.cheek_m};
  for (std::size_t i = 0; i < kCorners; ++i) {
    const PlanarVector run = corners_[(i + 1) % kCorners] - corners_[i];
    length_m_[i] = run.norm();
    along_[i] = run / length_m_[i];
    outward_[i] = -perp(along_[i]);
    radius_m_ = std::max(radius_m_, corners_[i].norm());
  }
  const BucketLinkage& linkage = machine.bucket_linkage;
  radius_m_ = std::max(radius_m_, linkage.bucket_pin_m.norm() + linkage.coupler_length_m);
}

std::size_t BucketOutline::nearest_side(const PlanarVector& at_m) const noexcept {
  std::size_t nearest = 0;
  for (std::size_t i = 1; i < kCorners; ++i) {
    if (outside(i, at_m) > outside(nearest, at_m)) nearest = i;
  }
  return nearest;
}

PlanarVector BucketOutline::nearest(const PlanarVector& at_m) const noexcept {
  PlanarVector best = corners_[0];
  double best2 = (at_m - best).squaredNorm();
  for (std::size_t i = 0; i < kCorners; ++i) {
    const double run = std::clamp((at_m - corners_[i]).dot(along_[i]), 0.0, length_m_[i]);
    const PlanarVector point = corners_[i] + run * along_[i];
    const double distance2 = (at_m - point).squaredNorm();
    if (distance2 < best2) {
      best = point;
      best2 = distance2;
    }
  }
  return best;
}

namespace {

constexpr double kNear_m = 0.02;  // further than anything moves within a substep
constexpr double kAlong = 0.1;    // sine of the lean of a side that still lies along a surface

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

/// The surface through which a place of the bucket has come in: the one that it slipped off where a corner of the wall
/// has held it since; the one that its side lies along where the corner presses on that side; else the nearest.
std::size_t Wall::surface_entered(std::size_t place, const std::array<double, kSurfaces>& depth,
                                  const BucketMotion& bucket, const BucketOutline& outline) const noexcept {
  for (std::size_t end = 0; end < kEnds; ++end) {
    const Pair& corner = ends_[end];
    if (!corner.touched) continue;
    if (corner.slipped == place) return places_[place].surface;
    if (corner.surface != place && (corner.surface + 1) % kCorners != place) continue;
    const PlanarVector outward = bucket.turn * outline.outward(corner.surface);
    if (std::abs(outward.dot(end_normal(end))) < kAlong) return kFace;
    if (std::abs(outward.dot(normal_)) < kAlong) return end_surface(end);
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

/// Whether a side of the bucket faces both surfaces that meet at this corner, or leans away from them by no more.
bool Wall::faces(std::size_t side, std::size_t end, double lean, const BucketMotion& bucket,
                 const BucketOutline& outline) const noexcept {
  const PlanarVector outward = bucket.turn * outline.outward(side);
  return outward.dot(normal_) <= lean && outward.dot(end_normal(end)) <= lean;
}

/// The side of the bucket that a corner of the wall is least far behind, of those that face both its surfaces: pushed
/// out by another, what slides off the end would hook behind it.
/// @param next_to only the two sides next to this corner of the bucket; kPlaces: any. @return kCorners: there is none.
std::size_t Wall::facing_side(std::size_t end, std::size_t next_to, const PlanarVector& in_bucket_m,
                              const BucketMotion& bucket, const BucketOutline& outline) const noexcept {
  std::size_t nearest = kCorners;
  for (std::size_t i = 0; i < kCorners; ++i) {
    if (next_to != kPlaces && next_to != i && next_to != (i + 1) % kCorners) continue;
    if (!faces(i, end, kAlong, bucket, outline)) continue;
    if (nearest == kCorners || outline.outside(i, in_bucket_m) > outline.outside(nearest, in_bucket_m)) nearest = i;
  }
  return nearest;
}

/// The corner of the bucket that pressed on a surface and has just gone past this corner of the wall.
/// @return kPlaces: there is none.
std::size_t Wall::slips_off(std::size_t end, const BucketMotion& bucket, const BucketOutline& outline) const noexcept {
  for (std::size_t i = 0; i < kCorners; ++i) {
    if (!places_[i].touched) continue;
    const std::array<double, kSurfaces> depth = depths_m(outline.place(i, bucket));
    if (places_[i].surface == kFace && depth[end_surface(end)] <= 0) return i;
    if (places_[i].surface == end_surface(end) && depth[kFace] <= 0) return i;
  }
  return kPlaces;
}

/// Whether a corner of the bucket is past one of the surfaces that meet at a corner of the wall, and behind the other.
bool Wall::is_past(std::size_t place, std::size_t end, const BucketMotion& bucket,
                   const BucketOutline& outline) const noexcept {
  const std::array<double, kSurfaces> depth = depths_m(outline.place(place, bucket));
  return (depth[kFace] <= 0) != (depth[end_surface(end)] <= 0);
}

Wall::Touch Wall::touch_of_end(std::size_t end, const BucketMotion& bucket,
                               const BucketOutline& outline) const noexcept {
  Touch touch;
  touch.at_m = end_m(end);
  const PlanarVector in_bucket_m = bucket.turn.back(touch.at_m - bucket.pin_m);
  const std::size_t nearest = outline.nearest_side(in_bucket_m);
  const bool within = outline.outside(nearest, in_bucket_m) < 0;
  const bool held = ends_[end].touched && faces(ends_[end].surface, end, 2 * kAlong, bucket, outline);
  const std::size_t slips = slips_off(end, bucket, outline);
  touch.slipped = slips == kPlaces && held ? ends_[end].slipped : slips;
  if (!within && !held && slips == kPlaces) return touch;
  touch.surface = held ? ends_[end].surface : facing_side(end, slips, in_bucket_m, bucket, outline);
  if (touch.surface == kCorners) return touch;
  const std::size_t beside = outline.nearer_corner(touch.surface, in_bucket_m);
  if (touch.surface != nearest) {
    // A side further behind takes the corner only after a slip, and only until what slipped is in the wall again.
    if (!held && slips == kPlaces) return touch;
    if (touch_of_place(beside, bucket, outline).depth_m > 0) return touch;
  }
  const double outside = outline.outside(touch.surface, in_bucket_m);
  if (outside >= 0) return touch;
  // Pressed in, a corner of the bucket slips off before the corner of the wall is within the outline.
  constexpr double kStillBeside = 2;  // how far from that corner of the bucket, along its side, in depths
  const double from_m = (in_bucket_m - outline.corner(beside)).dot(outline.along(touch.surface));
  if (!within && (!is_past(beside, end, bucket, outline) || std::abs(from_m) > kStillBeside * -outside)) return touch;
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
  if (!pair.touched || pair.surface != touch.surface) slide.anchor_m = touch.slide_m;
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
  if (!pair.touched || pair.surface != touch.surface) pair.slide.anchor_m = touch.slide_m;
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
