// What the bucket touches: walls that push back and break, soil, pipes, loads that are scooped, hung on and dumped.
#include "sim/world.h"

#include <gtest/gtest.h>

#include "sim/soil.h"
#include "test_plant.h"

namespace knuckle::sim {
namespace {

using namespace std::chrono_literals;

bool happened(const Plant& plant, WorldEventKind kind) {
  const WorldEventRing& events = plant.state().events;
  for (std::uint64_t n = 0; n < events.count; ++n) {
    if (events.at(n).kind == kind) return true;
  }
  return false;
}

WallDescription wall_below(double gap_m) {
  return {
      .point_m = make_plant().state().tip_world_m - PlanarVector(0, gap_m), .normal = {0, 1}, .stiffness_N_per_m = 1e6};
}

TEST(Wall, BreaksAboveItsForceAndItsPieceCanBeScoopedCarriedAndDumped) {
  WorldDescription world;
  WallDescription wall = wall_below(0.01);
  wall.break_force_N = 3000;
  wall.break_impulse_Ns = 200;
  wall.piece_mass_kg = 45;
  wall.piece_rest_m = wall.point_m + PlanarVector(-0.05, 0);
  world.walls.push_back(wall);
  Plant plant = make_plant(world);
  plant.set_valve_demand(kBoom, -0.4);
  while (!happened(plant, WorldEventKind::kPieceBroke) && plant.state().t_s < 5) plant.step(1ms);
  EXPECT_TRUE(happened(plant, WorldEventKind::kContact));
  ASSERT_TRUE(happened(plant, WorldEventKind::kPieceBroke));
  plant.set_valve_demand(kBoom, 0);
  run(plant, 1);
  ASSERT_TRUE(happened(plant, WorldEventKind::kPieceDown));
  plant.set_valve_demand(kBoom, 0.3);  // back to the piece, then curl through it
  while (plant.state().tip_world_m.y() < wall.piece_rest_m.y() && plant.state().t_s < 8) plant.step(1ms);
  plant.set_valve_demand(kBoom, 0);
  plant.set_valve_demand(kBucket, 0.3);
  run(plant, 1.5);
  ASSERT_TRUE(happened(plant, WorldEventKind::kScooped));
  EXPECT_NEAR(plant.state().payload_kg, 45, 1e-9);
  plant.set_valve_demand(kBucket, -0.6);
  run(plant, 3);
  EXPECT_TRUE(happened(plant, WorldEventKind::kDumped));
  EXPECT_EQ(plant.state().payload_kg, 0);
}

TEST(Wall, DoesNotBreakBelowItsForce) {
  WorldDescription world;
  world.walls.push_back(wall_below(0.01));
  world.walls[0].break_force_N = 60e3;
  Plant plant = make_plant(world);
  plant.set_valve_demand(kBoom, -0.3);
  run(plant, 3);
  EXPECT_FALSE(happened(plant, WorldEventKind::kPieceBroke));
}

TEST(Wall, FrictionHoldsASidewaysPullBelowItsCone) {
  Bristle face{2e6, 4e3};
  face.anchor_m = 0;
  EXPECT_NEAR(face.force(1e-4, 0, 1000), -200, 1e-9);  // sticks
  face.drag(1e-4, 1000);
  EXPECT_EQ(face.anchor_m, 0);
  EXPECT_EQ(face.force(1e-2, 0.1, 1000), -1000);  // slides
  face.drag(1e-2, 1000);
  EXPECT_NEAR(face.anchor_m, 1e-2 - 5e-4, 1e-12);
}

/// A soil with its surface at z = 0 and a bucket that is led through it.
struct Ground {
  BucketOutline outline{test::solar()};
  SoilDescription description{.surface_point_m = {0, 0}};
  Soil soil{description, outline, 3.2};
  BucketMotion bucket;

  /// Tip at a point, mouth towards the machine, moving.
  void place(const PlanarVector& tip_m, const PlanarVector& velocity_mps, double angle_rad = -2.2) {
    bucket.turn = Turn(angle_rad);
    bucket.angle_rad = angle_rad;
    bucket.pin_m = tip_m - bucket.turn * outline.tip();
    bucket.pin_mps = velocity_mps;
    bucket.linkage_m = bucket.pin_m + PlanarVector(0, 0.3);
    bucket.linkage_mps = velocity_mps;
  }
  /// From where it is to another point at a speed, as the plant would move it.
  void lead(const PlanarVector& from_m, const PlanarVector& to_m, double speed_mps) {
    constexpr double h = 2.5e-4;
    const double seconds = (to_m - from_m).norm() / speed_mps;
    for (double t = 0; t < seconds; t += h) {
      place(from_m + t / seconds * (to_m - from_m), (to_m - from_m) / seconds);
      soil.advance(bucket, outline, h);
    }
  }
  [[nodiscard]] PlanarVector force() const {
    ContactForces forces;
    soil.add_forces(bucket, outline, forces);
    return forces.soil;
  }
};

TEST(Soil, ResistanceGrowsWithDepthAndOpposesTravel) {
  Ground ground;
  double last = 0;
  for (double depth = 0.02; depth < 0.3; depth += 0.04) {
    Ground fresh;
    fresh.lead({2.0, -depth}, {1.8, -depth}, 0.3);
    EXPECT_GT(fresh.force().x(), last) << depth;
    last = fresh.force().x();
  }
  EXPECT_GT(last, 1e3);
  EXPECT_LT(last, 3e4);
  ground.place({2.0, 0.6}, {-0.3, 0});
  EXPECT_EQ(ground.force().norm(), 0);
}

TEST(Soil, WhatIsCutAwayResistsNoMore) {
  Ground ground;
  ground.lead({2.0, 0.05}, {2.0, -0.08}, 0.2);
  ground.lead({2.0, -0.08}, {1.6, -0.08}, 0.3);
  const double first = ground.force().x();
  ground.lead({1.6, -0.08}, {1.6, 0.1}, 0.3);
  ground.lead({1.6, 0.1}, {1.95, 0.1}, 0.3);
  ground.lead({1.95, 0.1}, {1.95, -0.075}, 0.3);
  ground.lead({1.95, -0.075}, {1.8, -0.075}, 0.3);
  EXPECT_LT(ground.force().x(), 0.2 * first);
}

TEST(Soil, PressedSoilSpringsBackByLittleAndCarriesLessWhereItWasPressed) {
  Ground ground;
  ground.lead({2.0, 0.02}, {2.0, -0.04}, 0.1);
  const double pressed = ground.force().y();
  EXPECT_GT(pressed, 500);
  ground.lead({2.0, -0.04}, {2.0, -0.03}, 0.1);
  EXPECT_LT(ground.force().y(), 0.1 * pressed);
}

TEST(Soil, HeelStandsOnIt) {
  Ground ground;
  const BucketOutline& outline = ground.outline;
  ground.place({0, 0}, {0, -0.1}, 0);
  const double angle = -std::numbers::pi / 2 - std::atan2(outline.corner(2).y(), outline.corner(2).x());
  const double height = outline.corner(2).norm() - 0.03;  // the heel straight below the pin, 3 cm deep
  for (int i = 0; i < 100; ++i) {
    ground.place(PlanarVector(2.0, height) + Turn(angle) * outline.tip(), {0, -0.1}, angle);
    ground.soil.advance(ground.bucket, outline, 2.5e-4);
  }
  EXPECT_GT(ground.force().y(), 1000);
}

TEST(Soil, DiggingFillsTheBucketNoFurtherThanItsVolume) {
  WorldDescription world;
  SoilDescription soil;
  soil.surface_point_m = make_plant().state().tip_world_m + PlanarVector(0, 0.02);
  world.soil.push_back(soil);
  world.dump_angle_rad = 0;
  Plant plant = make_plant(world);
  demand(plant, {-0.15, 0.6, 0});  // arm in, boom pressing lightly
  run(plant, 3);
  EXPECT_GT(plant.state().payload_kg, 1);
  EXPECT_LE(plant.state().payload_kg, soil.bucket_capacity_m3 * soil.density_kg_per_m3 + 1e-9);
}

TEST(Weight, HangsFromTheStartWithoutAJolt) {
  WorldDescription world;
  world.weights.push_back({.mass_kg = 100, .point_m = {0.4, 0}});
  Plant plant = make_plant(world);
  EXPECT_EQ(plant.state().payload_kg, 100);
  run(plant, 1);
  EXPECT_LT((plant.state().joint_rad - kWorkingPose).norm(), 1e-9);
}

TEST(Pipe, PushesRadiallyOutwards) {
  WorldDescription world;
  const PlanarVector tip = make_plant().state().tip_world_m;
  world.pipes.push_back({.centre_m = tip - PlanarVector(0, 0.08)});
  Plant plant = make_plant(world);
  plant.set_valve_demand(kBoom, -0.25);
  double most = 0;
  for (int i = 0; i < 1500; ++i) {
    plant.step(1ms);
    most = std::max(most, plant.state().pipe_N.y());
  }
  EXPECT_GT(most, 500);
  EXPECT_TRUE(happened(plant, WorldEventKind::kPipeTouched));
}

}  // namespace
}  // namespace knuckle::sim
