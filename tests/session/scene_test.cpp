// What drawings show of a world, and when.
#include "app/session/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace knuckle::session {
namespace {

constexpr double kReach_m = 3.2;

std::vector<SceneLine> named(const Scene& scene, const std::string& name) {
  std::vector<SceneLine> lines;
  std::copy_if(scene.begin(), scene.end(), std::back_inserter(lines),
               [&](const SceneLine& l) { return l.name == name; });
  return lines;
}

double lowest(const SceneLine& line) {
  return std::min_element(line.points_m.begin(), line.points_m.end(), [](auto& a, auto& b) { return a.y() < b.y(); })
      ->y();
}
double highest_of(const SceneLine& line) {
  return std::max_element(line.points_m.begin(), line.points_m.end(), [](auto& a, auto& b) { return a.y() < b.y(); })
      ->y();
}

sim::WallDescription upright_wall() {
  sim::WallDescription wall;
  wall.point_m = {2.5, 0};
  return wall;  // normal (-1, 0): "from" and "to" run downwards
}

TEST(Scene, AWallIsAnAreaBehindItsFace) {
  sim::WorldDescription world;
  world.walls = {upright_wall()};
  const auto walls = named(scene_of(world, {}, kReach_m), "wall");
  ASSERT_EQ(walls.size(), 1U);
  EXPECT_TRUE(walls[0].closed);
  for (const PlanarVector& p : walls[0].points_m) {
    EXPECT_GE(p.x(), 2.5);
    EXPECT_LE(p.x(), 3.0);
  }
  EXPECT_NEAR(highest_of(walls[0]), kReach_m / 2, 1e-9);
  EXPECT_NEAR(lowest(walls[0]), -kReach_m / 2, 1e-9);
}

TEST(Scene, AFaceIsDrawnWhereItIsHoweverFarAlong) {
  sim::WorldDescription world;
  world.walls = {upright_wall(), upright_wall()};
  world.walls[0].from_m = 2;
  world.walls[0].to_m = 3;  // downwards
  world.walls[1].from_m = 2;
  const auto walls = named(scene_of(world, {}, kReach_m), "wall");
  EXPECT_NEAR(highest_of(walls[0]), -2, 1e-9);
  EXPECT_NEAR(lowest(walls[0]), -3, 1e-9);
  EXPECT_NEAR(highest_of(walls[1]), -2, 1e-9);
  EXPECT_LT(lowest(walls[1]), -2.5);
}

TEST(Scene, AWallStandsUntilItBreaksAndItsPieceLiesUntilItIsScooped) {
  sim::WorldDescription world;
  world.walls = {upright_wall()};
  world.walls[0].break_force_N = 2000;
  world.walls[0].piece_depth_m = 0.3;
  world.walls[0].piece_rest_m = {2.0, -0.7};
  SessionRecord record;
  record.events = {{30, name(sim::WorldEventKind::kPieceBroke)},
                   {30.6, name(sim::WorldEventKind::kPieceDown)},
                   {45, name(sim::WorldEventKind::kScooped)}};
  const Scene scene = scene_of(world, record, kReach_m);
  const auto walls = named(scene, "wall");
  ASSERT_EQ(walls.size(), 2U);
  EXPECT_EQ(walls[0].until_s, 30);
  EXPECT_EQ(walls[1].from_s, 30);
  EXPECT_NEAR(walls[1].points_m[0].x(), 2.8, 1e-9) << "stands back by the depth of the piece";
  const auto pieces = named(scene, "piece");
  ASSERT_EQ(pieces.size(), 1U);
  EXPECT_EQ(pieces[0].from_s, 30.6);
  EXPECT_EQ(pieces[0].until_s, 45);
  EXPECT_EQ(named(scene_of(world, {}, kReach_m), "piece").size(), 0U) << "it did not break";
}

TEST(Scene, SoilIsASlopeAndAPipeARing) {
  sim::WorldDescription world;
  world.soil.resize(1);
  world.soil[0].surface_point_m = {0, -0.6};
  world.soil[0].slope_rad = 0.1;
  world.pipes.resize(1);
  world.pipes[0].centre_m = {1.5, -0.9};
  world.pipes[0].radius_m = 0.05;
  const Scene scene = scene_of(world, {}, kReach_m);
  const SceneLine soil = named(scene, "soil").at(0), pipe = named(scene, "pipe").at(0);
  EXPECT_FALSE(soil.closed);
  const PlanarVector along = soil.points_m.back() - soil.points_m.front();
  EXPECT_NEAR(std::atan2(along.y(), along.x()), 0.1, 1e-9);
  EXPECT_GT(along.norm(), kReach_m) << "as far as the machine reaches";
  EXPECT_TRUE(pipe.closed);
  for (const PlanarVector& p : pipe.points_m) EXPECT_NEAR((p - world.pipes[0].centre_m).norm(), 0.05, 1e-12);
}

}  // namespace
}  // namespace knuckle::session
