#include "sim/soil.h"

#include <algorithm>
#include <cmath>

namespace knuckle::sim {
namespace {

constexpr double kGravity = 9.80665;
constexpr double kRakeCosine = 0.96;
constexpr double kUnloading_N_per_m = 2e6;  // pressed soil springs back by little
constexpr double kBearingDamping_Ns_per_m = 1e4;
constexpr double kFreshGround_m = 0.05;  // the edge stands on new ground after this much sideways travel

}  // namespace

Soil::Soil(const SoilDescription& description)
    : description_(description),
      point_(description.surface_point_m),
      along_(std::cos(description.slope_rad), std::sin(description.slope_rad)),
      up_(perp(along_)) {
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

double Soil::bearing(double depth_m) const noexcept {
  return description_.bearing_area_m2 * description_.bearing_modulus_N_per_m_n2 *
         std::pow(depth_m, description_.bearing_exponent);
}

PlanarVector Soil::force(const PlanarVector& tip_m, const PlanarVector& tip_mps) const noexcept {
  const double d = depth(tip_m);
  if (d <= 0) return PlanarVector::Zero();
  const double sinking = -up_.dot(tip_mps);
  const double load = d >= pressed_m_
                          ? bearing(d) + std::min(1.0, d / 0.01) * kBearingDamping_Ns_per_m * std::max(0.0, sinking)
                          : bearing(pressed_m_) - kUnloading_N_per_m * (pressed_m_ - d);
  const double drag = edge_.force(along_.dot(tip_m), along_.dot(tip_mps), cutting_limit(d));
  return std::max(0.0, load) * up_ + drag * along_;
}

void Soil::advance(const PlanarVector& tip_m, const PlanarVector& tip_mps, const PlanarVector& blade,
                   double dt) noexcept {
  const double d = depth(tip_m);
  const double travel = along_.dot(tip_mps);
  // The rake is the angle between blade and surface on the side the edge moves to.
  const Factors n = factors(travel > 0 ? blade.dot(along_) : -blade.dot(along_));
  weight_factor_ = description_.bucket_width_m * description_.density_kg_per_m3 * kGravity * n.weight;
  cohesion_factor_ = description_.bucket_width_m * description_.cohesion_Pa * n.cohesion;
  edge_.drag(along_.dot(tip_m), cutting_limit(d));
  if (d <= 0) {
    pressed_m_ = 0;
  } else if (d > pressed_m_) {
    pressed_m_ = d;
  } else {
    pressed_m_ -= (pressed_m_ - d) * std::min(1.0, std::abs(travel) * dt / kFreshGround_m);
  }
}

double Soil::swept_kgps(const PlanarVector& tip_m, const PlanarVector& tip_mps) const noexcept {
  const double d = depth(tip_m);
  if (d <= 0) return 0;
  return description_.density_kg_per_m3 * description_.bucket_width_m * d * std::max(0.0, -along_.dot(tip_mps));
}

}  // namespace knuckle::sim
