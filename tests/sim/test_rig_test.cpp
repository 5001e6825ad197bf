// What a test rig does to the plant: a known pull at the tip, and weights hung on and taken off.
#include <gtest/gtest.h>

#include "machine/kinematics.h"
#include "test_plant.h"

namespace knuckle::sim {
namespace {

using namespace std::chrono_literals;

JointVector torque(const PlantState& s) {
  return s.lever_m.cwiseProduct(s.cylinder_N);
}

TEST(TestRig, PullIsExactlyBalancedWithFrictionAndGravity) {
  Plant plant = make_plant();
  plant.set_pull({1000, -1500});
  run(plant, 4);
  const PlantState& s = plant.state();
  // Torques of chambers less friction, with the pull, hold what the unloaded machine needs in this very pose.
  Plant unloaded = make_plant({}, s.joint_rad);
  const JointVector gravity = torque(unloaded.state());
  const JointVector held = s.lever_m.cwiseProduct(s.cylinder_N - s.friction_N) +
                           Kinematics(test::solar()).tip_jacobian(s.joint_rad).transpose() * s.contact_N;
  EXPECT_LT((held - gravity).norm(), 1e-3 * gravity.norm());
}

TEST(TestRig, WorkOfAMovingPullIsInTheLedger) {
  Plant plant = make_plant();
  const EnergyLedger start = plant.state().energy;
  double through = 0, worked = 0;
  for (int i = 0; i < 4000; ++i) {
    const double t = i * 1e-3;
    demand(plant, {0.4 * std::sin(2 * t), 0.5 * std::sin(1.7 * t + 1), 0.4 * std::sin(2.3 * t)});
    plant.set_pull(1500 * std::min(1.0, t) * PlanarVector(std::sin(3 * t), std::cos(2 * t)));
    plant.step(1ms);
    const PlantState& s = plant.state();
    through += through_J(s);
    worked -= 1e-3 * s.contact_N.dot(s.tip_mps);
  }
  const EnergyLedger& e = plant.state().energy;
  EXPECT_GT(std::abs(worked), 20);
  EXPECT_NEAR(e.contact.in - start.contact.in, worked, 0.01 * through);
  EXPECT_LT(missing_J(e.links, start.links), 1e-3 * through);
}

TEST(TestRig, HungWeightEqualsOneOfTheScenario) {
  WorldDescription world;
  world.weights.push_back(
      {.mass_kg = 80, .point_m = test::solar().payload_com_m, .attach_at_s = 0.5, .detach_at_s = 1.5});
  Plant scripted = make_plant(world), hung = make_plant();
  run(scripted, 0.5);
  run(hung, 0.5);
  hung.hang(80);
  run(scripted, 1);
  run(hung, 1);
  EXPECT_DOUBLE_EQ(hung.state().payload_kg, 80);
  EXPECT_EQ(hung.state().payload_m, test::solar().payload_com_m);
  EXPECT_EQ(hung.state().chamber_Pa, scripted.state().chamber_Pa);
  hung.hang(0);
  run(scripted, 1);
  run(hung, 1);
  EXPECT_EQ(hung.state().payload_kg, 0);
  EXPECT_LT((hung.state().joint_rad - scripted.state().joint_rad).norm(), 1e-12);
}

TEST(TestRig, AnotherWeightTakesThePlaceOfTheOneBefore) {
  Plant plant = make_plant();
  plant.hang(80);
  run(plant, 1);
  plant.hang(30);
  run(plant, 1);
  EXPECT_DOUBLE_EQ(plant.state().payload_kg, 30);
}

TEST(TestRig, NonFinitePullIsNone) {
  Plant plant = make_plant();
  plant.set_pull({std::numeric_limits<double>::quiet_NaN(), 100});
  run(plant, 0.1);
  EXPECT_EQ(plant.state().contact_N.norm(), 0);
}

}  // namespace
}  // namespace knuckle::sim
