#include "app/session/scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

namespace knuckle::session {
namespace {

// Of the machine's reach:
constexpr double kEndlessFace = 0.5;  // drawn of a face to a side where it has no end
constexpr double kSoil = 1.25;
constexpr double kGroundRear = -0.8, kGroundFront = 1.4;
constexpr double kNever_s = 1e18;

double time_of(const SessionRecord& record, std::string_view event, double fallback) {
  for (const EventRecord& e : record.events) {
    if (e.what == event) return e.t_s;
  }
  return fallback;
}

SceneLine face(const sim::WallDescription& wall, double reach_m, double back_m, double from_s, double until_s) {
  const PlanarVector n = wall.normal.normalized(), t(-n.y(), n.x());
  const double drawn = kEndlessFace * reach_m;
  const double from = std::isfinite(wall.from_m) ? wall.from_m : std::min(-drawn, wall.to_m - drawn);
  const double to = std::isfinite(wall.to_m) ? wall.to_m : std::max(drawn, from + drawn);
  const PlanarVector front = wall.point_m - back_m * n, behind = wall.point_m - wall.depth_m * n;
  return {"wall",
          SceneLine::Kind::kWall,
          {front + from * t, front + to * t, behind + to * t, behind + from * t},
          true,
          from_s,
          until_s,
          wall.break_force_N > 0 && back_m == 0};
}

SceneLine lump(const PlanarVector& at, double mass_kg, double from_s, double until_s) {
  const double s = sim::piece_radius_m(mass_kg);
  return {"piece",
          SceneLine::Kind::kPiece,
          {at + PlanarVector(-s, -s), at + PlanarVector(s, -s), at + PlanarVector(s, s), at + PlanarVector(-s, s)},
          true,
          from_s,
          until_s};
}

}  // namespace

Scene scene_of(const sim::WorldDescription& world, const SessionRecord& record, double reach_m) {
  Scene scene;
  if (world.ground) {
    const double z = world.ground->height_m;
    scene.push_back({"ground",
                     SceneLine::Kind::kGround,
                     {PlanarVector(kGroundRear * reach_m, z), PlanarVector(kGroundFront * reach_m, z)},
                     false,
                     0,
                     kNever_s});
  }
  const double broke_s = time_of(record, name(sim::WorldEventKind::kPieceBroke), kNever_s);
  const double down_s = time_of(record, name(sim::WorldEventKind::kPieceDown), kNever_s);
  const double scooped_s = time_of(record, name(sim::WorldEventKind::kScooped), kNever_s);
  for (const sim::WallDescription& wall : world.walls) {
    const bool breaks = wall.break_force_N > 0;
    scene.push_back(face(wall, reach_m, 0, 0, breaks ? broke_s : kNever_s));
    if (!breaks || broke_s == kNever_s) continue;
    scene.push_back(face(wall, reach_m, wall.piece_depth_m, broke_s, kNever_s));
    scene.push_back(lump(wall.piece_rest_m, wall.piece_mass_kg, down_s, scooped_s));
  }
  for (const sim::LoosePieceDescription& piece : world.pieces)
    scene.push_back(lump(piece.position_m, piece.mass_kg, 0, scooped_s));
  for (const sim::SoilDescription& soil : world.soil) {
    const PlanarVector along(std::cos(soil.slope_rad), std::sin(soil.slope_rad));
    scene.push_back({"soil",
                     SceneLine::Kind::kSoil,
                     {soil.surface_point_m, soil.surface_point_m + kSoil * reach_m * along},
                     false,
                     0,
                     kNever_s});
  }
  for (const sim::PipeDescription& pipe : world.pipes) {
    SceneLine ring{"pipe", SceneLine::Kind::kPiece, {}, true, 0, kNever_s};
    for (int i = 0; i < 24; ++i) {
      const double a = i * std::numbers::pi / 12;
      ring.points_m.push_back(pipe.centre_m + pipe.radius_m * PlanarVector(std::cos(a), std::sin(a)));
    }
    scene.push_back(std::move(ring));
  }
  return scene;
}

}  // namespace knuckle::session
