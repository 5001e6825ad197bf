// Soil under the bucket: its edge cuts, by the fundamental earthmoving equation, and every corner bears on what is
// left, by pressure-sinkage. The surface remembers where it was cut and pressed.
#pragma once

#include <array>

#include "sim/contact.h"
#include "sim/world.h"

namespace knuckle::sim {

class Soil {
 public:
  /// @param reach_m of the machine: the surface is remembered as far as that.
  Soil(const SoilDescription& description, const BucketOutline& outline, double reach_m);

  void add_forces(const BucketMotion& bucket, const BucketOutline& outline, ContactForces& forces) const noexcept;
  /// Moves anchors and surface after a substep.
  void advance(const BucketMotion& bucket, const BucketOutline& outline, double dt) noexcept;
  /// How far the bucket is above the undisturbed surface.
  [[nodiscard]] double clearance_m(const BucketMotion& bucket, const BucketOutline& outline) const noexcept;
  /// Greatest resistance along the surface at a depth, with the bucket as it was at the last advance.
  [[nodiscard]] double cutting_limit(double depth_m) const noexcept {
    return depth_m > 0 ? depth_m * (weight_factor_ * depth_m + cohesion_factor_) : 0;
  }
  /// How far the tip is below the surface that it moves against, as of the last advance; 0 above it.
  [[nodiscard]] double cutting_depth_m() const noexcept { return cutting_depth_m_; }
  /// Mass that the tip sweeps into the bucket [kg/s]; nothing moving away from the machine.
  [[nodiscard]] double swept_kgps() const noexcept { return swept_kgps_; }
  [[nodiscard]] double capacity_kg() const noexcept {
    return description_.bucket_capacity_m3 * description_.density_kg_per_m3;
  }

 private:
  static constexpr int kRakes = 33;
  static constexpr std::size_t kCells = 512;
  struct Factors {
    double weight = 0, cohesion = 0;
  };
  /// Heights over the undisturbed surface.
  struct Cell {
    double ground_m = 0;   ///< Where sinkage counts from: what has not been cut away.
    double deepest_m = 0;  ///< To where it has been pressed.
  };
  /// A point over the surface: along it, above it, and its velocity likewise.
  struct Local {
    double along_m, up_m, along_mps, up_mps;
  };
  [[nodiscard]] Local local(std::size_t place, const BucketMotion& bucket, const BucketOutline& outline) const noexcept;
  [[nodiscard]] Factors factors(double rake_cosine) const noexcept;
  [[nodiscard]] Cell surface(double along_m) const noexcept;
  [[nodiscard]] double cell_at(double along_m) const noexcept;
  /// Normal force on a place that sinks below the surface.
  [[nodiscard]] double bearing(std::size_t place, const Local& at) const noexcept;
  [[nodiscard]] double plate(std::size_t place, double sinkage_m) const noexcept;
  [[nodiscard]] double sideways_limit(std::size_t place, const Local& at, double normal_N) const noexcept;
  void cut(const Local& tip, double dt) noexcept;
  void press(std::size_t place, const Local& at) noexcept;

  SoilDescription description_;
  PlanarVector point_, along_, up_;
  double first_m_, cell_m_;
  std::array<Cell, kCells> cells_{};
  std::array<Factors, kRakes> table_{};  // over the cosine of the rake angle, -0.96 .. 0.96
  std::array<double, kPlaces> area_m2_{};
  std::array<Bristle, kPlaces> slide_;
  double weight_factor_ = 0, cohesion_factor_ = 0;
  double travel_ = -1;  // direction in which the tip last moved along the surface
  double cutting_depth_m_ = 0, swept_kgps_ = 0;
};

}  // namespace knuckle::sim
