#include "sim/soil.h"

#include <algorithm>
#include <cmath>

#include "sim/rigid_body.h"

namespace knuckle::sim {
namespace {

constexpr double kRakeCosine = 0.96;
constexpr double kUnloading_N_per_m3 = 1.7e8;  // per bearing area: pressed soil springs back by little
constexpr double kBearingDamping_Ns_per_m3 = 8e5;
constexpr double kSoftTouch_m = 0.01;         // sinkage at which the damping is whole
constexpr double kFreshGround_m = 0.01;       // a cutting edge has cleared its ground after this much travel
constexpr double kClearedAhead_m = 0.03;      // and so far ahead of it
constexpr double kSurfaceAhead_m = 0.06;      // what it cuts is as high as the surface here
constexpr double kPlateLength = 0.12;         // of a corner's bearing plate, in bucket lengths
constexpr double kCheekShare = 0.1;           // of the bucket's width: two plates
constexpr double kRear = -0.3, kFront = 1.3;  // of the surface that is remembered, in reaches from the boom pin

}  // namespace

Soil::Soil(const SoilDescription& description, const BucketOutline& outline, double reach_m)
    : description_(description),
      point_(description.surface_point_m),
      along_(std::cos(description.slope_rad), std::sin(description.slope_rad)),
      up_(perp(along_)),
      first_m_(-point_.dot(along_) + kRear * reach_m),
      cell_m_((kFront - kRear) * reach_m / kCells) {
  slide_.fill(Bristle{1e6, 3e3});
  area_m2_.fill(description.bucket_width_m * kPlateLength * outline.tip().x());
  area_m2_[static_cast<std::size_t>(BucketPlace::kTip)] = description.bearing_area_m2;
  area_m2_[static_cast<std::size_t>(BucketPlace::kCheek)] *= kCheekShare;
  // McKyes 1985: the failure wedge angle is the one of least weight factor.
  const double phi = description.internal_friction_rad, delta = description.tool_friction_rad;
  constexpr double kCap = 20;
  for (int i = 0; i < kRakes; ++i) {
    const double rake = std::acos(kRakeCosine * (2.0 * i / (kRakes - 1) - 1));
    Factors best{kCap, kCap};
    for (double beta = 0.09; beta < std::numbers::pi - phi - 0.09; beta += 0.01) {
      const double hold = std::cos(rake + delta) + std::sin(rake + delta) / std::tan(beta + phi);
      const double weight = 0.5 * (1 / std::tan(rake) + 1 / std::tan(beta)) / hold;
      if (hold > 0.05 && weight > 0 && weight < best.weight) {
        best = {weight, std::clamp((1 + 1 / (std::tan(beta) * std::tan(beta + phi))) / hold, 0.0, kCap)};
      }
    }
    table_[static_cast<std::size_t>(i)] = best;
  }
}

Soil::Factors Soil::factors(double cosine) const noexcept {
  const double at = (std::clamp(cosine, -kRakeCosine, kRakeCosine) / kRakeCosine + 1) * 0.5 * (kRakes - 1);
  const int low = std::min(static_cast<int>(at), kRakes - 2);
  const double part = at - low;
  const Factors &a = table_[static_cast<std::size_t>(low)], &b = table_[static_cast<std::size_t>(low + 1)];
  return {a.weight + part * (b.weight - a.weight), a.cohesion + part * (b.cohesion - a.cohesion)};
}

Soil::Local Soil::local(std::size_t place, const BucketMotion& bucket, const BucketOutline& outline) const noexcept {
  const PlanarVector offset = outline.place(place, bucket) - point_, velocity = outline.velocity(place, bucket);
  return {offset.dot(along_), offset.dot(up_), velocity.dot(along_), velocity.dot(up_)};
}

double Soil::cell_at(double along_m) const noexcept {
  const double at = (along_m - first_m_) / cell_m_;
  return at > 0 ? std::min(at, static_cast<double>(kCells) - 2.001) : 0;  // not a number: 0
}

double Soil::clearance_m(const BucketMotion& bucket, const BucketOutline& outline) const noexcept {
  double clearance = (bucket.pin_m - point_).dot(up_);
  for (std::size_t i = 0; i < kPlaces; ++i)
    clearance = std::min(clearance, (outline.place(i, bucket) - point_).dot(up_));
  return clearance;
}

Soil::Cell Soil::surface(double along_m) const noexcept {
  const double at = cell_at(along_m);
  const auto i = static_cast<std::size_t>(at);
  const double part = at - static_cast<double>(i);
  const Cell &a = cells_[i], &b = cells_[i + 1];
  return {a.ground_m + part * (b.ground_m - a.ground_m), a.deepest_m + part * (b.deepest_m - a.deepest_m)};
}

double Soil::plate(std::size_t place, double sinkage_m) const noexcept {
  return sinkage_m > 0 ? area_m2_[place] * description_.bearing_modulus_N_per_m_n2 *
                             std::pow(sinkage_m, description_.bearing_exponent)
                       : 0;
}

double Soil::bearing(std::size_t place, const Local& at) const noexcept {
  const Cell cell = surface(at.along_m);
  const double sinkage = cell.ground_m - at.up_m;
  if (sinkage <= 0) return 0;
  const double virgin = plate(place, sinkage);
  if (at.up_m > cell.deepest_m) {  // has been pressed further down before: springs back along a steeper line
    const double spring = kUnloading_N_per_m3 * area_m2_[place];
    return std::clamp(plate(place, cell.ground_m - cell.deepest_m) - spring * (at.up_m - cell.deepest_m), 0.0, virgin);
  }
  return virgin + std::min(1.0, sinkage / kSoftTouch_m) * kBearingDamping_Ns_per_m3 * area_m2_[place] *
                      std::max(0.0, -at.up_mps);
}

double Soil::sideways_limit(std::size_t place, const Local& at, double normal_N) const noexcept {
  const double friction = std::tan(description_.tool_friction_rad) * normal_N;
  if (place != static_cast<std::size_t>(BucketPlace::kTip)) return friction;
  return friction + cutting_limit(surface(at.along_m + travel_ * kSurfaceAhead_m).ground_m - at.up_m);
}

void Soil::add_forces(const BucketMotion& bucket, const BucketOutline& outline, ContactForces& forces) const noexcept {
  if ((bucket.pin_m - point_).dot(up_) > outline.radius_m()) return;
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const Local at = local(i, bucket, outline);
    if (at.up_m > 0) continue;
    const double normal = bearing(i, at);
    const double limit = sideways_limit(i, at, normal);
    if (limit <= 0) continue;
    forces.on_place(&ContactForces::soil, bucket, i, outline.place(i, bucket),
                    normal * up_ + slide_[i].force(at.along_m, at.along_mps, limit) * along_);
  }
}

void Soil::cut(const Local& tip, double dt) noexcept {
  const double share = std::min(1.0, std::abs(tip.along_mps) * dt / kFreshGround_m);
  const double from = std::min(tip.along_m, tip.along_m + travel_ * kClearedAhead_m) - cell_m_;
  const double to = std::max(tip.along_m, tip.along_m + travel_ * kClearedAhead_m) + cell_m_;
  const auto last = static_cast<std::size_t>(cell_at(to));
  for (auto i = static_cast<std::size_t>(cell_at(from)); i <= last; ++i) {
    Cell& cell = cells_[i];
    if (cell.ground_m > tip.up_m) cell.ground_m += share * (tip.up_m - cell.ground_m);
    cell.deepest_m = std::min(cell.deepest_m, cell.ground_m);
  }
}

void Soil::press(std::size_t place, const Local& at) noexcept {
  const double half = std::max(cell_m_, 0.5 * area_m2_[place] / description_.bucket_width_m);
  const auto last = static_cast<std::size_t>(cell_at(at.along_m + half)) + 1;
  for (auto i = static_cast<std::size_t>(cell_at(at.along_m - half)); i <= last; ++i) {
    if (cells_[i].ground_m > at.up_m) cells_[i].deepest_m = std::min(cells_[i].deepest_m, at.up_m);
  }
}

void Soil::advance(const BucketMotion& bucket, const BucketOutline& outline, double dt) noexcept {
  const Local tip = local(static_cast<std::size_t>(BucketPlace::kTip), bucket, outline);
  if (tip.along_mps != 0) travel_ = std::copysign(1.0, tip.along_mps);
  // The rake is the angle between blade and surface on the side the edge moves to.
  const PlanarVector blade(bucket.turn.c, bucket.turn.s);
  const Factors n = factors(travel_ * blade.dot(along_));
  weight_factor_ = description_.bucket_width_m * description_.density_kg_per_m3 * kGravity_mps2 * n.weight;
  cohesion_factor_ = description_.bucket_width_m * description_.cohesion_Pa * n.cohesion;
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const Local at = local(i, bucket, outline);
    const double normal = at.up_m > 0 ? 0 : bearing(i, at);
    slide_[i].drag(at.along_m, at.up_m > 0 ? 0 : sideways_limit(i, at, normal));
    if (at.up_m < 0) press(i, at);
  }
  cutting_depth_m_ = std::max(0.0, surface(tip.along_m + travel_ * kSurfaceAhead_m).ground_m - tip.up_m);
  swept_kgps_ =
      description_.density_kg_per_m3 * description_.bucket_width_m * cutting_depth_m_ * std::max(0.0, -tip.along_mps);
  if (tip.up_m < 0) cut(tip, dt);
}

}  // namespace knuckle::sim
