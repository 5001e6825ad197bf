// Soil at the bucket's edge: cutting resistance by the fundamental earthmoving equation, bearing by pressure-sinkage.
#pragma once

#include <array>

#include "sim/linkage.h"
#include "sim/world.h"

namespace knuckle::sim {

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

class Soil {
 public:
  explicit Soil(const SoilDescription& description);

  /// Depth of a point below the surface, negative above.
  [[nodiscard]] double depth(const PlanarVector& at_m) const noexcept { return (point_ - at_m).dot(up_); }
  /// Force on the tip, frame W.
  [[nodiscard]] PlanarVector force(const PlanarVector& tip_m, const PlanarVector& tip_mps) const noexcept;
  /// Moves anchors and footprint after a substep. @param blade unit vector from bucket pin to tip, frame W.
  void advance(const PlanarVector& tip_m, const PlanarVector& tip_mps, const PlanarVector& blade, double dt) noexcept;
  /// Greatest resistance along the surface at a depth, with the bucket as it was at the last advance.
  [[nodiscard]] double cutting_limit(double depth_m) const noexcept {
    return depth_m > 0 ? depth_m * (weight_factor_ * depth_m + cohesion_factor_) : 0;
  }
  /// Mass that a tip moving at this speed sweeps into the bucket [kg/s]; nothing moving away from the machine.
  [[nodiscard]] double swept_kgps(const PlanarVector& tip_m, const PlanarVector& tip_mps) const noexcept;
  [[nodiscard]] double capacity_kg() const noexcept {
    return description_.bucket_capacity_m3 * description_.density_kg_per_m3;
  }

 private:
  static constexpr int kRakes = 33;
  struct Factors {
    double weight = 0, cohesion = 0;
  };
  [[nodiscard]] Factors factors(double rake_cosine) const noexcept;
  [[nodiscard]] double bearing(double depth_m) const noexcept;

  SoilDescription description_;
  PlanarVector point_, along_, up_;
  std::array<Factors, kRakes> table_{};  // over the cosine of the rake angle, -0.96 .. 0.96
  double weight_factor_ = 0, cohesion_factor_ = 0;
  double pressed_m_ = 0;  // deepest footprint where the edge stands
  Bristle edge_{1e6, 3e3};
};

}  // namespace knuckle::sim
