#include "app/console/picture/world_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <string_view>

namespace knuckle::console::picture {
namespace {

using Eigen::Vector3d;

// In parts of the machine's reach:
constexpr double kGroundRear = -0.80, kGroundFront = 1.40, kGroundHalf = 0.44;
constexpr double kGroundThick = 0.05, kSoilThick = 0.30;
constexpr double kWallHalf = 0.34, kVirtualHalf = 0.30;

const session::SceneLine* first_of(const session::Scene& scene, session::SceneLine::Kind kind) {
  const auto found = std::find_if(scene.begin(), scene.end(), [&](const session::SceneLine& line) {
    return line.kind == kind && line.points_m.size() > 1;
  });
  return found == scene.end() ? nullptr : &*found;
}

/// The slab ends where a square of its grid does.
double ground_half_m(double reach) {
  return std::ceil(kGroundHalf * reach / grid_step_m(reach)) * grid_step_m(reach);
}

void add_grid(Mesh& grid, double rear_m, double front_m, double half_m, double z_m, double step_m) {
  for (double x = std::ceil(rear_m / step_m) * step_m; x < front_m; x += step_m)
    grid.line({x, -half_m, z_m}, {x, half_m, z_m}, Material::kGround);
  for (double y = -std::floor(half_m / step_m) * step_m; y <= half_m; y += step_m)
    grid.line({rear_m, y, z_m}, {front_m, y, z_m}, Material::kGround);
}

/// A slab with a grid where the scene has ground, and a block of soil where it has soil; elsewhere nothing is known to
/// be solid, and nothing is drawn.
void add_ground(WorldMeshes& world, const session::Scene& scene, double reach) {
  const double half = ground_half_m(reach);
  if (const session::SceneLine* ground = first_of(scene, session::SceneLine::Kind::kGround)) {
    const double level = ground->points_m.front().y(), step = grid_step_m(reach);
    const double rear = -std::floor(-kGroundRear * reach / step) * step;
    const double front = std::floor(kGroundFront * reach / step) * step;
    world.ground.box({rear, -half, level - kGroundThick * reach}, {front, half, level}, Material::kGround);
    add_grid(world.grid, rear, front, half, level, step);
  }
  if (const session::SceneLine* soil = first_of(scene, session::SceneLine::Kind::kSoil)) {
    Outline profile = soil->points_m;
    double bottom = profile.front().y();
    for (const PlanarVector& p : profile) bottom = std::min(bottom, p.y() - kSoilThick * reach);
    profile.emplace_back(profile.back().x(), bottom);
    profile.emplace_back(profile.front().x(), bottom);
    world.soil.extrude(profile, -half, half, Material::kSoil);
  }
}

/// Jagged lines across a face, the same every time.
void add_cracks(Mesh& cracks, const Outline& wall, double floor_m, double reach) {
  std::minstd_rand random(7);
  std::uniform_real_distribution<double> jitter(-1, 1);
  const double half = kWallHalf * reach;
  const PlanarVector& from = wall[0];  // the face, as scenes list it
  const PlanarVector along = wall[1] - wall[0];
  const PlanarVector out = 0.001 * reach * (wall[0] - wall[3]).normalized();
  const auto on_face = [&](double share, double y) {
    const PlanarVector p = from + share * along + out;
    return Vector3d(p.x(), y, p.y());
  };
  for (int line = 0; line < 8; ++line) {
    double share = 0.5 + 0.4 * jitter(random), y = 0.8 * half * jitter(random);
    const double turn = 0.5 * jitter(random);
    for (int step = 0; step < 9; ++step) {
      const double next_share = share + 0.045 * (turn + 0.9 * jitter(random));
      const double next_y = y + half * (line % 2 == 0 ? 0.14 : -0.14) * (1 + 0.5 * jitter(random));
      if (std::abs(next_y) > half || next_share < 0.02 || next_share > 0.98) break;
      const Vector3d a = on_face(share, y), b = on_face(next_share, next_y);
      if (std::min(a.z(), b.z()) > floor_m) cracks.line(a, b, Material::kBreakable);
      share = next_share;
      y = next_y;
    }
  }
}

/// What of it is below the ground is not seen.
void add_wall(WorldMeshes& world, const session::SceneLine& wall, double floor_m, double reach) {
  const Outline standing = above(wall.points_m, floor_m);
  if (standing.empty()) return;
  world.solids.extrude(standing, -kWallHalf * reach, kWallHalf * reach,
                       wall.breaks ? Material::kBreakable : Material::kWall);
  if (wall.breaks && wall.points_m.size() == 4) add_cracks(world.cracks, wall.points_m, floor_m, reach);
}

void add_piece(Mesh& solids, const session::SceneLine& piece, double reach) {
  if (piece.name == std::string_view("pipe")) {
    const double half = ground_half_m(reach) + 0.01 * reach;
    solids.extrude(piece.points_m, -half, half, Material::kPipe);
    return;
  }
  Eigen::AlignedBox2d box;
  for (const PlanarVector& p : piece.points_m) box.extend(p);
  const double half = 0.6 * box.sizes().x();
  // Broken, not sawn: corners off.
  const PlanarVector c = box.center(), r = box.sizes() / 2;
  const auto at = [&](double x, double z) { return PlanarVector(c + PlanarVector(x, z).cwiseProduct(r)); };
  solids.extrude({at(-1, -0.9), at(-0.5, -1), at(0.8, -1), at(1, -0.3), at(0.75, 0.7), at(0.1, 1), at(-0.8, 0.75)},
                 -half, half, Material::kPiece);
}

/// Each piece of the line is a rectangle across the arm's plane, hatched; and ticks in that plane for the side view.
void add_virtual_wall(Mesh& lines, const session::SceneLine& wall, double reach) {
  const double half = kVirtualHalf * reach, spacing = 0.05 * reach;
  for (std::size_t i = 0; i + 1 < wall.points_m.size(); ++i) {
    const PlanarVector a = wall.points_m[i], ray = wall.points_m[i + 1] - a;
    const double length = ray.norm();
    if (length <= 0) continue;
    const auto at = [&](double along, double y) {
      const PlanarVector p = a + std::clamp(along / length, 0.0, 1.0) * ray;
      return Vector3d(p.x(), y, p.y());
    };
    const Vector3d corners[] = {at(0, -half), at(length, -half), at(length, half), at(0, half)};
    for (std::size_t k = 0; k < 4; ++k) lines.line(corners[k], corners[(k + 1) % 4], Material::kMarker);
    const Vector3d forbidden = Vector3d(ray.y() / length, 0, -ray.x() / length);
    for (double along = spacing; along <= length; along += spacing)
      lines.line(at(along, 0), at(along - 0.4 * spacing, 0) + 0.4 * spacing * forbidden, Material::kMarker);
    // Lines of 45 deg: along - y = s, cut off at the rectangle.
    for (double s = -half + spacing; s < length + half; s += spacing) {
      const double from = std::max(0.0, s - half), to = std::min(length, s + half);
      lines.line(at(from, from - s), at(to, to - s), Material::kMarker);
    }
  }
}

}  // namespace

session::Scene virtual_walls(const LimitsDescription& limits, double reach_m) {
  constexpr double kFar_m = 1e6;  // the description's word for "no limit" is farther
  const double low = std::max(limits.floor_m, -0.9 * reach_m), high = std::min(limits.ceiling_m, 0.9 * reach_m);
  const double back = 0.15 * reach_m, front = std::min(limits.reach_m, 1.05 * reach_m);
  session::Scene walls;
  if (limits.floor_m > -kFar_m)
    walls.push_back({"floor", session::SceneLine::Kind::kVirtualWall, {{back, low}, {front, low}}});
  if (limits.ceiling_m < kFar_m)
    walls.push_back({"ceiling", session::SceneLine::Kind::kVirtualWall, {{front, high}, {back, high}}});
  if (limits.reach_m < kFar_m)
    walls.push_back({"reach", session::SceneLine::Kind::kVirtualWall, {{limits.reach_m, low}, {limits.reach_m, high}}});
  return walls;
}

double grid_step_m(double reach_m) {
  return reach_m < 5 ? 0.5 : reach_m < 10 ? 1 : 2;
}

session::Scene scene_at(const session::Scene& scene, double time_s) {
  session::Scene now;
  std::copy_if(scene.begin(), scene.end(), std::back_inserter(now), [&](const session::SceneLine& line) {
    return time_s >= line.from_s && time_s < line.until_s && line.points_m.size() > 1;
  });
  return now;
}

double track_level_m(const session::Scene& scene, double reach_m) {
  const double usual = -0.25 * reach_m;
  for (const auto kind : {session::SceneLine::Kind::kGround, session::SceneLine::Kind::kSoil})
    if (const session::SceneLine* line = first_of(scene, kind))
      return std::clamp(line->points_m.front().y(), 1.6 * usual, 0.6 * usual);
  return usual;
}

WorldMeshes world_meshes(const session::Scene& scene, double reach_m) {
  WorldMeshes world;
  add_ground(world, scene, reach_m);
  const session::SceneLine* ground = first_of(scene, session::SceneLine::Kind::kGround);
  const double floor_m = ground != nullptr ? ground->points_m.front().y() : -1e9;
  for (const session::SceneLine& line : scene) {
    if (line.kind == session::SceneLine::Kind::kWall && line.closed) add_wall(world, line, floor_m, reach_m);
    if (line.kind == session::SceneLine::Kind::kPiece && line.closed) add_piece(world.solids, line, reach_m);
    if (line.kind == session::SceneLine::Kind::kVirtualWall) add_virtual_wall(world.virtual_walls, line, reach_m);
  }
  return world;
}

Mesh disc_mesh() {
  Mesh mesh;
  mesh.cone({0, 0.004, 0}, {0, -0.004, 0}, 1, 1, Material::kMarker, 40);
  return mesh;
}

Mesh grid_mesh() {
  constexpr int kGridLines = 48;  // to each side of the middle
  Mesh mesh;
  for (int i = -kGridLines; i <= kGridLines; ++i) {
    mesh.line({double(i), 0, -kGridLines}, {double(i), 0, kGridLines}, Material::kMarker);
    mesh.line({-kGridLines, 0, double(i)}, {kGridLines, 0, double(i)}, Material::kMarker);
  }
  return mesh;
}

Mesh arrow_shaft() {
  Mesh mesh;
  mesh.tube({0, 0, 0}, {1, 0, 0}, 1, Material::kMarker);
  return mesh;
}

Mesh arrow_head() {
  Mesh mesh;
  mesh.cone({0, 0, 0}, {1, 0, 0}, 1, 0, Material::kMarker);
  return mesh;
}

void LiveScene::begin(const sim::WorldDescription& world) {
  world_ = world;
  record_.events.clear();
  read_ = 0;
  scene_ = session::scene_of(world_, record_, reach_m_);
}

void LiveScene::watch(const sim::WorldEventRing& events) {
  if (events.count < read_) begin(world_);  // the session was restarted
  if (events.count == read_) return;
  constexpr auto kCapacity = sim::WorldEventRing::kCapacity;
  read_ = std::max(read_, events.count > kCapacity ? events.count - kCapacity : 0);
  const auto changes_the_scene = [](sim::WorldEventKind kind) {
    return kind == sim::WorldEventKind::kPieceBroke || kind == sim::WorldEventKind::kPieceDown ||
           kind == sim::WorldEventKind::kScooped;
  };
  for (; read_ < events.count; ++read_) {
    const sim::WorldEvent& event = events.at(read_);
    if (changes_the_scene(event.kind)) record_.events.push_back({event.t_s, name(event.kind)});
  }
  scene_ = session::scene_of(world_, record_, reach_m_);
}

}  // namespace knuckle::console::picture
