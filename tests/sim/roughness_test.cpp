// What a machine does that its data sheets do not say: each effect alone against its closed form, all together against
// the balance of energy.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "machine/kinematics.h"
#include "sim/hydraulics.h"
#include "sim/plant_model.h"
#include "test_plant.h"

namespace knuckle::sim {
namespace {

using namespace std::chrono_literals;

constexpr double kSubstep = 0.25e-3;

ValveDescription plain_valve() {
  ValveDescription valve = test::solar().cylinders[kBoom].valve;
  valve.hysteresis = 0;
  return valve;
}

/// Opening of a valve that has come to rest at a demand.
double opening_at(const ValveRoughness& rough, double demand, double warmth_K = 0) {
  Spool spool(plain_valve(), rough, kSubstep);
  spool.demand(demand);
  for (int i = 0; i < 4000; ++i) spool.advance(true, warmth_K);
  return spool.opening();
}

Plant rough_plant(const std::function<void(MachineTruth&)>& change, const WorldDescription& world = {}) {
  MachineTruth truth = nominal_truth(test::solar());
  change(truth);
  Plant plant(truth, world, kWorkingPose);
  plant.set_pilot(true);
  return plant;
}

TEST(RoughValve, FollowsItsCurve) {
  const double dead = plain_valve().dead_band_extend, half = dead + 0.5 * (1 - dead);
  EXPECT_NEAR(opening_at({}, half), 0.5, 1e-6);
  EXPECT_NEAR(opening_at({.curve_exponent = 1.5}, half), std::pow(0.5, 1.5), 1e-6);
  EXPECT_NEAR(opening_at({.curve_exponent = 1.5}, 1), 1, 1e-6);
  const ValveRoughness notched{.notch_opening = 0.4, .notch_slope = 0.25};
  EXPECT_NEAR(opening_at(notched, dead + 0.2 * (1 - dead)), 0.05, 1e-6);
  EXPECT_NEAR(opening_at(notched, dead + 0.4 * (1 - dead)), 0.1, 1e-6);
  EXPECT_NEAR(opening_at(notched, 1), 1, 1e-6);
  EXPECT_NEAR(opening_at({.retract_gain = 0.8}, -half), -0.4, 1e-6);
  EXPECT_NEAR(opening_at({.retract_gain = 0.8}, half), 0.5, 1e-6);
}

TEST(RoughValve, ZeroMovesWithTheOil) {
  const double dead = plain_valve().dead_band_extend;
  EXPECT_NEAR(opening_at({.null_drift_per_K = 1e-3}, 0.5, 40), (0.54 - dead) / (1 - dead), 1e-6);
  EXPECT_NEAR(opening_at({.null_drift_per_K = 1e-3}, dead - 0.01, 40), 0.03 / (1 - dead), 1e-6);
}

TEST(RoughValve, StaysUntilItsTargetIsFarEnoughAway) {
  Spool spool(plain_valve(), {.stiction = 0.03}, kSubstep);
  const auto rest_at = [&](double demand) {
    spool.demand(demand);
    for (int i = 0; i < 4000; ++i) spool.advance(true, 0);
    return spool.position();
  };
  EXPECT_NEAR(rest_at(0.5), 0.5, 4e-3);
  const double held = rest_at(0.5);
  EXPECT_NEAR(rest_at(0.52), held, 4e-3);
  EXPECT_NEAR(rest_at(0.48), held, 4e-3);
  EXPECT_NEAR(rest_at(0.56), 0.56, 4e-3);
}

TEST(RoughCylinder, LeaksByPressureDifference) {
  // A load held by locked valves sinks: head and rod side even out through the piston.
  const double leakage = 0.5e-3 / 60 / 1e7;
  Plant tight = make_plant(),
        leaking = rough_plant([&](MachineTruth&t) { t.valve[kBoom].leakage_m3ps_per_Pa = leakage; });
  const double difference = leaking.state().chamber_Pa[0] - leaking.state().chamber_Pa[1];
  ASSERT_GT(difference, 10e5);
  run(tight, 3);
  run(leaking, 3);
  EXPECT_NEAR(tight.state().chamber_Pa[1], make_plant().state().chamber_Pa[1], 1e3);
  // Both sides' pressures rise until the trapped oil carries the load by the rod's area.
  EXPECT_GT(leaking.state().chamber_Pa[1], tight.state().chamber_Pa[1] + 5e5);
  EXPECT_LT(leaking.state().joint_rad[kBoom], tight.state().joint_rad[kBoom]);
}

TEST(RoughCylinder, FrictionGrowsWithPressure) {
  constexpr double kSeal = 7e-5;
  Plant plain = make_plant();
  Plant sealed = rough_plant([&](MachineTruth& t) { t.friction[kArm].seal_N_per_Pa = kSeal; });
  for (Plant* plant : {&plain, &sealed}) {
    plant->set_valve_demand(kArm, 0.3);
    run(*plant, 1.0);
  }
  EXPECT_GT(std::abs(sealed.state().friction_N[kArm]), 1.1 * std::abs(plain.state().friction_N[kArm]));
  const PlantState& s = sealed.state();
  ASSERT_GT(std::abs(s.cylinder_mps[kArm]), 0.02);
  const LuGreFriction friction = sealed.truth().friction[kArm];
  const double speed = std::abs(s.cylinder_mps[kArm]);
  const double coulomb = friction.coulomb_extend_N + kSeal * (s.chamber_Pa[2] + s.chamber_Pa[3]);
  const double stribeck = 1 + (friction.static_ratio - 1) / (1 + std::pow(speed / friction.stribeck_mps, 2));
  EXPECT_NEAR(std::abs(s.friction_N[kArm]), coulomb * stribeck + friction.viscous_Ns_per_m * speed,
              0.02 * std::abs(s.friction_N[kArm]));
}

TEST(RoughOil, WarmsUpAndGetsThinner) {
  Plant plant = rough_plant([](MachineTruth& t) { t.warm_up = {.rise_K = 30, .time_s = 2}; });
  run(plant, 2);
  EXPECT_NEAR(plant.state().warmth_K, 30 * (1 - std::exp(-1)), 0.05);
  Plant cold = make_plant();
  for (Plant* each : {&plant, &cold}) {
    each->set_valve_demand(kBoom, 0.4);
    run(*each, 1);
  }
  EXPECT_LT(plant.state().friction_N[kBoom], cold.state().friction_N[kBoom]);
}

/// How far the boom's rod end is ahead of the link.
double ahead_m(const Plant& plant) {
  const PlantState& s = plant.state();
  return s.cylinder_m[kBoom] - Kinematics(plant.truth().machine).cylinder_at(kBoom, s.joint_rad[kBoom])->length_m;
}

TEST(RoughPins, YieldByForceOverStiffnessAndByTheirPlay) {
  constexpr double kStiffness = 30e6, kPlay_m = 2e-3;
  Plant plant = rough_plant([](MachineTruth& t) { t.pin[kBoom] = compliant_pin(kStiffness, kPlay_m, 20); });
  const auto rest_under = [&](double up_N) {
    plant.set_pull(PlanarVector(0, up_N));
    run(plant, 3);
    return plant.state().cylinder_N[kBoom] - plant.state().friction_N[kBoom];
  };
  for (const double up_N : {-3000.0, 0.0, 6000.0, 0.0}) {
    const double force_N = rest_under(up_N);
    ASSERT_GT(std::abs(force_N), 2000) << "presses either way, or there is nothing to see";
    EXPECT_EQ(force_N > 0, up_N < 3000);
    const double expected_m = std::copysign(0.5 * kPlay_m, force_N) + force_N / kStiffness;
    EXPECT_NEAR(ahead_m(plant), expected_m, 0.02 * std::abs(expected_m));
  }
}

TEST(RoughPins, AreDrivenIntoBothStopsWithoutComingApart) {
  // Cushion, stop and thick oil all brake a rod that weighs little.
  Plant plant = rough_plant([](MachineTruth& t) {
    for (std::size_t i = 0; i < kJoints; ++i) {
      t.pin[i] = compliant_pin(20e6, 1e-3, 10);
      t.friction[i].viscous_Ns_per_m = 80e3;
    }
  });
  const EnergyLedger start = plant.state().energy;
  double through = 0;
  for (int i = 0; i < 12'000; ++i) {
    demand(plant, JointVector::Constant(i < 6'000 ? 1 : -1));
    plant.step(1ms);
    const PlantState& s = plant.state();
    through += through_J(s);
    ASSERT_TRUE(s.joint_rad.allFinite());
    ASSERT_LT(s.cylinder_mps.cwiseAbs().maxCoeff(), 3) << "at " << s.t_s << " s";
  }
  for (std::size_t i = 0; i < kJoints; ++i)
    EXPECT_LT(missing_J(plant.state().energy.piston[i], start.piston[i]), 5e-3 * through) << i;
}

TEST(RoughValves, TakeFlowFromEachOther) {
  // Straight from the model: what the pump feeds a cylinder at the same pressures.
  MachineTruth truth = nominal_truth(test::solar());
  const auto fed = [&](double cross_talk, double other) {
    truth.cross_talk = cross_talk;
    PlantModel model(truth);
    const WorldModel free({}, truth.machine);
    HeldInputs held;
    StateVector x = model.equilibrium(kWorkingPose, held.load);
    x[kPump] = 150e5;
    held.opening[kArm] = 0.3;
    held.opening[kBucket] = other;
    PlantDetail detail;
    (void)model.derivative(x, held, free, detail);
    return detail.feed[kArm];
  };
  EXPECT_EQ(fed(0, 0.5), fed(0, 0));
  EXPECT_NEAR(fed(0.08, 0.5) / fed(0, 0), 1 - 0.08 * 0.5, 1e-12);
  EXPECT_NEAR(fed(0.08, -1) / fed(0, 0), 1 - 0.08, 1e-12);
}

TEST(RoughPump, RegulatorOvershootsByItsDamping) {
  const auto overshoot = [](double damping) {
    Plant plant = rough_plant([&](MachineTruth& t) { t.pump = {.regulator_Hz = 5, .regulator_damping = damping}; });
    const double before = plant.state().pump_Pa;
    plant.set_valve_demand(kBoom, 0.3);
    double highest = before, settled = 0;
    for (int i = 0; i < 1000; ++i) {
      plant.step(1ms);
      highest = std::max(highest, plant.state().pump_Pa);
      if (i >= 700) settled += plant.state().pump_Pa / 300;
    }
    return (highest - before) / (settled - before) - 1;
  };
  const double damped = overshoot(1), swinging = overshoot(0.3);
  EXPECT_LT(damped, 0.2);              // the load's own swing
  EXPECT_GT(swinging, damped + 0.15);  // a second-order regulator alone: 0.37
}

TEST(Roughness, EnergyIsKeptWithAllOfIt) {
  WorldDescription world;
  world.ground = GroundDescription{.height_m = -0.9};
  Plant plant = rough_plant(
      [](MachineTruth& t) {
        for (std::size_t i = 0; i < kJoints; ++i) {
          t.valve[i] = {.curve_exponent = 1.4,
                        .notch_opening = 0.3,
                        .notch_slope = 0.5,
                        .retract_gain = 1.2,
                        .stiction = 0.02,
                        .null_drift_per_K = 5e-4,
                        .leakage_m3ps_per_Pa = 0.1e-3 / 60 / 1e7};
          t.friction[i].seal_N_per_Pa = 5e-5;
          t.friction[i].pin_share = 0.03;
        }
        t.pin[kBoom] = compliant_pin(30e6, 0.5e-3, 20);
        t.pin[kArm] = compliant_pin(40e6, 0.3e-3, 15);
        t.warm_up = {.rise_K = 30, .time_s = 5};
        t.pump = {.regulator_Hz = 5, .regulator_damping = 0.3};
        t.cross_talk = 0.05;
      },
      world);
  const EnergyLedger start = plant.state().energy;
  double through = 0;
  for (int i = 0; i < 6000; ++i) {
    const double t = i * 1e-3;
    demand(plant, {-0.05 + 0.5 * std::sin(2 * t), 0.6 * std::sin(1.7 * t + 1), 0.4 * std::sin(2.3 * t)});
    plant.step(1ms);
    through += through_J(plant.state());
  }
  const EnergyLedger& e = plant.state().energy;
  EXPECT_LT(missing_J(e.links, start.links), 1e-3 * through);
  EXPECT_LT(missing_J(e.pump, start.pump), 1e-3 * e.pump.in);
  for (std::size_t i = 0; i < kJoints; ++i) {
    EXPECT_LT(missing_J(e.valve[i], start.valve[i]), 1e-3 * std::abs(e.valve[i].in)) << i;
    EXPECT_LT(missing_J(e.chambers[i], start.chambers[i]), 1e-3 * through) << i;
    EXPECT_LT(missing_J(e.piston[i], start.piston[i]), 1e-3 * through) << i;
    EXPECT_GE(e.valve[i].lost, 0) << i;
    EXPECT_GE(e.piston[i].lost, 0) << i;
  }
}

TEST(Roughness, RestIsStillRest) {
  Plant plant = rough_plant([](MachineTruth& t) {
    for (std::size_t i = 0; i < kJoints; ++i) {
      t.valve[i].stiction = 0.03;
      t.friction[i].seal_N_per_Pa = 7e-5;
      t.pin[i] = compliant_pin(30e6, 0.5e-3, 15);
    }
    t.pump = {.regulator_Hz = 5, .regulator_damping = 0.3};
  });
  run(plant, 5);
  EXPECT_LT((plant.state().joint_rad - kWorkingPose).norm(), 1e-9);
}

}  // namespace
}  // namespace knuckle::sim
