// Solids made of triangles, put together from extruded outlines, tubes and boxes; no OpenGL. Space: x forward, y to
// the left, z up, metres; what lies in the arm's plane has y = 0.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/joints.h"

namespace knuckle::console::picture {

/// What a surface is made of; the colours are chosen elsewhere.
enum class Material : std::uint8_t {
  kPaint,
  kTrim,
  kSteel,
  kRod,
  kGlass,
  kRubber,
  kBucket,
  kGround,
  kWall,
  kBreakable,
  kPiece,
  kPipe,
  kSoil,
  kMarker,  ///< Arrow, ellipse, ring: its colour changes with what it says.
};
inline constexpr int kMaterials = 14;

struct MeshVertex {
  Eigen::Vector3f position_m;
  Eigen::Vector3f normal;  ///< Unit, outward.
  float material;
};

/// A closed line in a plane y = const, as (x, z); either sense.
using Outline = std::vector<PlanarVector>;

/// Every solid added is closed; triangles run counter-clockwise seen from outside.
class Mesh {
 public:
  /// The outline, which must not cross itself, from y = low_m to high_m. Corners of less than 35 deg are shaded round.
  void extrude(const Outline& outline, double low_m, double high_m, Material material);
  /// Two of them, from inner_m to outer_m on both sides of the arm's plane.
  void extrude_pair(const Outline& outline, double inner_m, double outer_m, Material material);
  void box(const Eigen::Vector3d& low_m, const Eigen::Vector3d& high_m, Material material);
  /// From one point to the other with these radii there; 0 makes a point.
  void cone(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m, double from_radius_m, double to_radius_m,
            Material material, int sides = 12);
  void tube(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m, double radius_m, Material material,
            int sides = 12) {
    cone(from_m, to_m, radius_m, radius_m, material, sides);
  }
  /// A pin across the arm's plane.
  void pin(const PlanarVector& at_m, double radius_m, double half_length_m, Material material);
  /// A line of its own, not of a solid.
  void line(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m, Material material);

  std::vector<MeshVertex> vertices;
  std::vector<std::uint32_t> triangles;  ///< Three vertices each.
  std::vector<std::uint32_t> edges;      ///< Two vertices each: sharp edges of the solids.
  std::vector<std::uint32_t> rounds;     ///< Likewise, of tubes and round corners: what may be a silhouette.

 private:
  std::uint32_t add(const Eigen::Vector3d& position_m, const Eigen::Vector3d& normal, Material material);
  void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d);
  void cap(const Outline& outline, double y_m, bool towards_left, Material material);
  void disc(const std::vector<Eigen::Vector3d>& rim, const Eigen::Vector3d& normal, Material material);
};

/// The convex hull of discs, each of so many corners: how plates and tapered beams look.
struct Disc {
  PlanarVector centre_m;
  double radius_m;
};
[[nodiscard]] Outline hull_of(const std::vector<Disc>& discs, int corners = 12);

/// A beam along a line of discs, round at its ends: unlike hull_of it follows the bends.
[[nodiscard]] Outline swept(const std::vector<Disc>& spine);

/// What of a convex or closed outline lies above z = floor_m; empty where nothing does.
[[nodiscard]] Outline above(const Outline& outline, double floor_m);

/// What of a convex outline a load fills that takes this share of its area, up to a level surface; empty for none.
[[nodiscard]] Outline filled(const Outline& outline, double share);

/// Triangles of a closed outline that does not cross itself, counter-clockwise seen with x right and z up; indices
/// into the outline, three each.
[[nodiscard]] std::vector<std::uint32_t> triangulated(const Outline& outline);

/// Positive where the outline runs counter-clockwise seen with x right and z up.
[[nodiscard]] double signed_area_m2(const Outline& outline);

}  // namespace knuckle::console::picture
