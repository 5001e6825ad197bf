// What the bucket can touch, as plain data that a scenario file fills, and the events that happen in it.
// Frame W: origin at M's origin (boom pin), x forward, z up against gravity; M is W turned by the hull pitch.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "core/joints.h"

namespace knuckle::sim {

/// One flat face. A point is in the wall where (point - point_m) . normal < 0; the face ends sideways at from_m, to_m
/// along the normal turned by +90 deg, where the wall has a corner and an end square to its face, and is felt to
/// depth_m behind its surface.
struct WallDescription {
  PlanarVector point_m = PlanarVector::Zero();
  PlanarVector normal = PlanarVector(-1, 0);  ///< Towards the free side; any length but zero.
  double stiffness_N_per_m = 1e6;             ///< Linear spring, 5e4..2e7, where hunt_crossley is 0.
  double damping_ratio = 0.3;               ///< Of the linear spring with the machine's effective mass at first touch.
  double hunt_crossley_N_per_m15 = 0;       ///< k in F = k d^1.5 (1 + 1.5 e d'), 1e8..1e9; 0 = linear spring.
  double hunt_crossley_loss_s_per_m = 0.5;  ///< e
  double friction = 0.4;                    ///< Coulomb, with an elastic bristle.
  double from_m = -std::numeric_limits<double>::infinity();
  double to_m = std::numeric_limits<double>::infinity();
  double depth_m = 0.5;
  // Breaking: damage grows with the normal force above break_force_N, the piece is loose at break_impulse_Ns.
  double break_force_N = 0;  ///< 0 = does not break.
  double break_impulse_Ns = 500;
  double piece_mass_kg = 40;
  double piece_depth_m = 0.15;                       ///< The face stands back by this much after the break.
  PlanarVector piece_rest_m = PlanarVector::Zero();  ///< Where the piece lies after its fall.
  double fall_time_s = 0.6;
};

/// Soil below a straight surface. Cutting: fundamental earthmoving equation (Reece; McKyes 1985), bearing:
/// pressure-sinkage p = k d^n (Bekker), payload: swept volume while the tip moves towards the machine.
struct SoilDescription {
  PlanarVector surface_point_m = PlanarVector(0, -1);
  double slope_rad = 0;
  double density_kg_per_m3 = 1700;
  double cohesion_Pa = 5000;
  double internal_friction_rad = 0.55;
  double tool_friction_rad = 0.35;
  double bucket_width_m = 0.45;
  double bearing_area_m2 = 0.012;           ///< Of the bucket's edge.
  double bearing_modulus_N_per_m_n2 = 3e6;  ///< k
  double bearing_exponent = 0.9;            ///< n
  double bucket_capacity_m3 = 0.04;
};

/// A mass hung at a point of the bucket from one time to another.
struct DeadWeightDescription {
  double mass_kg = 0;
  PlanarVector point_m = PlanarVector::Zero();  ///< Bucket axes.
  double attach_at_s = 0;
  double detach_at_s = std::numeric_limits<double>::infinity();
};

/// A piece on the ground that the bucket can scoop: caught when the tip passes within scoop_reach_m of its surface
/// while the bucket curls. Until then it is solid, and slides where it is pushed harder than its friction on the
/// ground.
struct LoosePieceDescription {
  double mass_kg = 0;
  PlanarVector position_m = PlanarVector::Zero();
};

/// Radius of a piece's outline.
[[nodiscard]] double piece_radius_m(double mass_kg) noexcept;

struct PipeDescription {
  PlanarVector centre_m = PlanarVector::Zero();
  double radius_m = 0.05;
  double stiffness_N_per_m = 5e6;
  double damping_Ns_per_m = 5e3;
};

/// Level ground on which the machine stands.
struct GroundDescription {
  double height_m = -1;
  double stiffness_N_per_m = 5e6, damping_ratio = 0.3, friction = 0.6;
};

struct WorldDescription {
  std::optional<GroundDescription> ground;  ///< None: there is soil, or nothing is known of what is below.
  std::vector<WallDescription> walls;
  std::vector<SoilDescription> soil;  ///< None or one.
  std::vector<DeadWeightDescription> weights;
  std::vector<LoosePieceDescription> pieces;
  std::vector<PipeDescription> pipes;
  double scoop_reach_m = 0.05;
  /// Bucket angle to the horizontal (sum of joints and hull pitch) above which a load falls out. With the default
  /// machine -pi/2 is a bucket straight down, -pi one with its tip level and towards the machine.
  double dump_angle_rad = -1.9;
};

enum class WorldEventKind : std::uint8_t {
  kContact,
  kRelease,
  kPieceBroke,
  kPieceDown,
  kScooped,
  kDug,
  kDumped,
  kPipeTouched,
  kWeightOn,
  kWeightOff
};
[[nodiscard]] const char* name(WorldEventKind kind) noexcept;  ///< "piece_broke", ...

struct WorldEvent {
  WorldEventKind kind = WorldEventKind::kContact;
  int index = 0;  ///< Which wall, piece or weight.
  double t_s = 0;
  double value = 0;  ///< Peak force [N] or mass [kg].
};

/// The last events; `count` never goes back, so a reader keeps the count it has read up to.
struct WorldEventRing {
  static constexpr std::uint64_t kCapacity = 32;
  std::array<WorldEvent, kCapacity> slots{};
  std::uint64_t count = 0;
  void push(const WorldEvent& event) noexcept { slots[count++ % kCapacity] = event; }
  /// Event number n (0 = first ever); valid for count - kCapacity <= n < count.
  [[nodiscard]] const WorldEvent& at(std::uint64_t n) const noexcept { return slots[n % kCapacity]; }
};

}  // namespace knuckle::sim
