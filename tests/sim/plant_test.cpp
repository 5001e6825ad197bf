// The simulated machine against physics: energy, rest, closed forms, limits, and the numbers its class is known for.
#include "sim/plant.h"

#include <gtest/gtest.h>

#include "test_plant.h"
#include "tests/support/no_alloc.h"

namespace knuckle::sim {
namespace {

using namespace std::chrono_literals;

TEST(Plant, RestStaysAtRestForEveryDrawnMachine) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Plant plant(sample_truth(test::solar(), seed), {}, kWorkingPose);
    run(plant, 5);
    EXPECT_LT((plant.state().joint_rad - kWorkingPose).norm(), 1e-9) << seed;
    EXPECT_LT(plant.state().joint_radps.norm(), 1e-9) << seed;
  }
}

TEST(Plant, SpoolsCentreWithoutPilotWhateverTheDemand) {
  Plant plant = make_plant();
  demand(plant, {1, 1, 1});
  run(plant, 0.3);
  EXPECT_GT(plant.state().spool.minCoeff(), 0.9);
  plant.set_pilot(false);
  run(plant, 0.2);
  EXPECT_LT(plant.state().spool.cwiseAbs().maxCoeff(), 0.02);
}

TEST(Plant, SpoolFollowsAfterDelayAndNotFasterThanItsFullStroke) {
  Plant plant = make_plant();
  plant.set_valve_demand(kBoom, 1);
  run(plant, test::solar().cylinders[0].valve.delay_s);
  EXPECT_LT(plant.state().spool[kBoom], 0.01);
  double last = plant.state().spool[kBoom], fastest = 0;
  for (int i = 0; i < 300; ++i) {
    plant.step(1ms);
    fastest = std::max(fastest, (plant.state().spool[kBoom] - last) / 1e-3);
    last = plant.state().spool[kBoom];
  }
  EXPECT_LE(fastest, 1 / test::solar().cylinders[0].valve.full_stroke_s * (1 + 1e-9));
  EXPECT_NEAR(last, 1 - test::solar().cylinders[0].valve.hysteresis / 2, 1e-6);
}

TEST(Plant, LockedChamberPressureRisesByStiffnessTimesSqueezedVolume) {
  // A load swings against closed spools: dp = -beta dV / V, integrated exactly over the stroke.
  WorldDescription world;
  world.weights.push_back({.mass_kg = 80, .point_m = {0.3, 0.1}, .attach_at_s = 0.01});
  Plant plant = make_plant(world);
  const double before = plant.state().chamber_Pa[0], length = plant.state().cylinder_m[kBoom];
  run(plant, 2);
  const CylinderDescription& cylinder = test::solar().cylinders[kBoom];
  const HydraulicsDescription& hydraulics = test::solar().hydraulics;
  const auto volume = [&](double l) {
    return hydraulics.hose_volume_m3 + cylinder.head_area_m2() * (l - cylinder.min_length_m);
  };
  const double squeezed = std::log(volume(length) / volume(plant.state().cylinder_m[kBoom]));
  const double rise = plant.state().chamber_Pa[0] - before;
  ASSERT_GT(rise, 10e5);
  // Above 50 bar the air in the oil takes at most 3 % off the stiffness.
  EXPECT_NEAR(rise, hydraulics.bulk_modulus_Pa * squeezed, 0.03 * rise);
}

TEST(Plant, SteadyCylinderSpeedFollowsTheOrificeEquation) {
  Plant plant = make_plant();
  plant.set_valve_demand(kBoom, 0.4);
  run(plant, 1.2);
  const PlantState& s = plant.state();
  const CylinderDescription& cylinder = test::solar().cylinders[kBoom];
  const double gain = cylinder.valve.nominal_flow_m3ps / std::sqrt(cylinder.valve.nominal_drop_Pa);
  const double inlet = gain * s.opening[kBoom] * std::sqrt(s.pump_Pa - s.chamber_Pa[0]) / cylinder.head_area_m2();
  const double outlet = gain * s.opening[kBoom] * std::sqrt(s.chamber_Pa[1] - test::solar().hydraulics.tank_Pa) /
                        cylinder.rod_side_area_m2();
  EXPECT_GT(s.cylinder_mps[kBoom], 0.02);
  EXPECT_NEAR(s.cylinder_mps[kBoom], inlet, 0.02 * inlet);
  EXPECT_NEAR(s.cylinder_mps[kBoom], outlet, 0.02 * outlet);
}

TEST(Plant, PumpIsSharedWhereTheAxesAskForMoreThanItHas) {
  Plant one = make_plant();
  one.set_valve_demand(kBucket, -1);
  run(one, 0.5);
  Plant all = make_plant();
  demand(all, {1, -1, -1});
  run(all, 0.5);
  EXPECT_LT(all.state().pump_share, 0.9);
  EXPECT_LE(all.state().pump_m3ps, test::solar().hydraulics.pump_flow_m3ps * (1 + 1e-12));
  EXPECT_LT(std::abs(all.state().cylinder_mps[kBucket]), 0.95 * std::abs(one.state().cylinder_mps[kBucket]));
}

TEST(Plant, EndStopHoldsFullPumpPressureAndMainReliefLimitsIt) {
  for (const int joint : {kBoom, kArm, kBucket}) {
    for (const double direction : {1.0, -1.0}) {
      Plant plant = make_plant();
      plant.set_valve_demand(joint, direction);
      run(plant, 4);
      const PlantState& s = plant.state();
      const auto n = static_cast<std::size_t>(joint);
      const LinkDescription& link = test::solar().links[n];
      EXPECT_LT(std::abs(s.joint_radps[joint]), 0.01);
      EXPECT_GT(s.joint_rad[joint], link.min_rad - 0.08);
      EXPECT_LT(s.joint_rad[joint], link.max_rad + 0.08);
      EXPECT_NEAR(s.pump_Pa, test::solar().hydraulics.main_relief_Pa, 5e5);
    }
  }
}

TEST(Plant, PortReliefBoundsALockedChamber) {
  WorldDescription world;
  world.weights.push_back({.mass_kg = 1000, .point_m = {0.3, 0.1}, .attach_at_s = 0.01});
  Plant plant = make_plant(world);
  run(plant, 1);
  double mean = 0;
  for (int i = 0; i < 200; ++i) {
    plant.step(1ms);
    mean += plant.state().chamber_Pa[0] / 200;
  }
  const double setting = test::solar().hydraulics.port_relief_Pa;
  EXPECT_LT(plant.state().joint_rad[kBoom], kWorkingPose[kBoom] - 0.02);  // the boom gives way
  EXPECT_GT(mean, setting);
  EXPECT_LT(mean, 1.05 * setting);
  EXPECT_GT(plant.state().energy.chambers[kBoom].lost, 100);
}

TEST(Plant, BucketBreakoutForceIsThatOfTheClass) {
  // After ISO 6015: bucket cylinder at the main relief, force square to the bucket at the tip.
  const JointVector pose(0.3, -1.5, -1.0);
  // A stiff block square to the bucket, where a curling (clockwise) tip goes, and as narrow as a load cell.
  const PlanarVector against(std::sin(pose.sum()), -std::cos(pose.sum()));
  WorldDescription world;
  world.walls.push_back({.point_m = make_plant(world, pose).state().tip_world_m + 1e-3 * against,
                         .normal = -against,
                         .stiffness_N_per_m = 2e7,
                         .friction = 0,
                         .from_m = -0.01,
                         .to_m = 0.01});
  Plant plant = make_plant(world, pose);
  plant.set_valve_demand(kBucket, 0.5);
  double most = 0;
  for (int i = 0; i < 3000; ++i) {
    plant.step(1ms);
    if (i > 1500) most = std::max(most, plant.state().wall_N.norm());
  }
  RecordProperty("breakout_N", static_cast<int>(most));
  EXPECT_GT(most, 10e3);
  EXPECT_LT(most, 16e3);
}

TEST(Plant, StepAllocatesNothing) {
  WorldDescription world;
  world.ground = GroundDescription{.height_m = make_plant().state().tip_world_m.y() - 0.02};
  world.walls.push_back({.point_m = make_plant().state().tip_world_m + PlanarVector(0.55, 0)});
  world.pieces.push_back({.mass_kg = 20, .position_m = make_plant().state().tip_world_m - PlanarVector(0.4, 0)});
  world.soil.push_back({.surface_point_m = {0, -1.2}});
  Plant plant = make_plant(world);
  demand(plant, {-0.4, -0.4, 0.5});
  test::NoAllocScope scope;
  run(plant, 1);
  EXPECT_EQ(scope.allocations(), 0u);
}

TEST(Plant, NonFiniteDemandIsNeutral) {
  Plant plant = make_plant();
  demand(plant, JointVector::Constant(std::numeric_limits<double>::quiet_NaN()));
  run(plant, 0.2);
  EXPECT_EQ(plant.state().spool.norm(), 0);
}

}  // namespace
}  // namespace knuckle::sim
