// The hull on compliant ground: at rest it stays, it rocks at the frequency of its springs, tips when it must, and no
// energy is made.
#include <gtest/gtest.h>

#include "core/error.h"
#include "sim/plant_model.h"
#include "test_plant.h"

namespace knuckle::sim {
namespace {

using namespace std::chrono_literals;

HullTruth soft_hull() {
  HullTruth hull;
  hull.mass_kg = 1250;
  hull.track_m = 1.2;
  hull.stiffness_N_per_m = 5e5;
  hull.damping_Ns_per_m = 3e3;
  hull.inertia_kgm2 = 300;
  hull.com_m = {-0.1, 0.58};
  hull.centre_m = {-0.7, -0.8};
  return hull;
}

Plant plant_on(const HullTruth& hull, const WorldDescription& world = {}, const JointVector& start = kWorkingPose) {
  MachineTruth truth = nominal_truth(test::solar());
  truth.hull = hull;
  Plant plant(truth, world, start);
  plant.set_pilot(true);
  return plant;
}

TEST(HullOnGround, RestStaysAtRest) {
  Plant plant = plant_on(soft_hull());
  run(plant, 5);
  EXPECT_LT(std::abs(plant.state().hull_pitch_rad) + std::abs(plant.state().hull_heave_m), 1e-9);
  EXPECT_LT((plant.state().joint_rad - kWorkingPose).norm(), 1e-9);
  // Both ends together bear the machine.
  const double arm_kg = 100 + 60 + 60 + 12 + 6 + 11 + 6 + 9 + 5 + 3 + 4;
  EXPECT_NEAR(plant.state().track_N[0] + plant.state().track_N[1], 9.80665 * (1250 + arm_kg), 300);
}

TEST(HullOnGround, YieldsByForceOverStiffness) {
  Plant plant = plant_on(soft_hull());
  const PlanarVector before = plant.state().tip_world_m;
  const double pull_N = -800;
  plant.set_pull({0, pull_N});
  run(plant, 10);
  const PlantState& s = plant.state();
  ASSERT_LT(s.joint_radps.norm(), 1e-3);
  const HullTruth hull = soft_hull();
  const double lever_m = before.x() - hull.centre_m.x();
  EXPECT_NEAR(s.hull_heave_m, pull_N / (2 * hull.stiffness_N_per_m),
              0.05 * std::abs(pull_N) / (2 * hull.stiffness_N_per_m));
  const double pitch_stiffness = hull.stiffness_N_per_m * hull.track_m * hull.track_m / 2;
  EXPECT_NEAR(s.hull_pitch_rad, pull_N * lever_m / pitch_stiffness,
              0.08 * std::abs(pull_N * lever_m / pitch_stiffness));
}

TEST(HullOnGround, TipsWhereItsTracksCanPushNoMore) {
  Plant plant = plant_on(soft_hull());
  plant.set_pull({0, -6000});
  run(plant, 0.5);
  EXPECT_EQ(plant.state().track_N[0], 0);  // the rear has left the ground
  EXPECT_LT(plant.state().hull_pitch_rad, -0.02);
}

TEST(HullOnGround, MachineThatWouldTipAtTheStartIsRefused) {
  HullTruth light = soft_hull();
  light.mass_kg = 100;
  light.com_m.x() = 0.5;
  EXPECT_THROW(plant_on(light, {}, {0.2, -0.6, -0.2}), InputError);
}

TEST(HullOnGround, OverloadedGroundSinksForGood) {
  HullTruth hull = soft_hull();
  hull.settling_m_per_N = 2e-6;
  hull.bearing_ratio = 1.05;
  Plant plant = plant_on(hull);
  plant.set_pull({0, -1500});
  run(plant, 4);
  plant.set_pull({0, 0});
  run(plant, 6);
  const double left = plant.state().hull_pitch_rad;
  EXPECT_LT(left, -1e-4);
  plant.set_pull({0, -1500});  // the same again: it bears that now
  run(plant, 4);
  plant.set_pull({0, 0});
  run(plant, 6);
  EXPECT_NEAR(plant.state().hull_pitch_rad, left, 0.1 * std::abs(left));
}

TEST(HullOnGround, KeepsItsEnergyWhileAllAxesMoveAndTheBucketKnocks) {
  WorldDescription world;
  world.ground = GroundDescription{.height_m = -0.9};
  HullTruth hull = soft_hull();
  hull.settling_m_per_N = 1e-6;
  Plant plant = plant_on(hull, world);
  const EnergyLedger start = plant.state().energy;
  double through = 0, rocked = 0;
  for (int i = 0; i < 6000; ++i) {
    const double t = i * 1e-3;
    demand(plant, {-0.1 + 0.5 * std::sin(2 * t), 0.6 * std::sin(1.7 * t + 1), 0.4 * std::sin(2.3 * t)});
    plant.step(1ms);
    through += through_J(plant.state());
    rocked = std::max(rocked, std::abs(plant.state().hull_pitch_rad));
  }
  EXPECT_GT(rocked, 2e-3);
  const EnergyLedger& e = plant.state().energy;
  EXPECT_LT(missing_J(e.links, start.links), 1e-3 * through);
}

}  // namespace
}  // namespace knuckle::sim
