// Joints whose valves tell nothing, held against what the machine's own controller was told.
#include "slave/motion_monitor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "machine/oil_stiffness.h"
#include "tests/slave/reasons.h"
#include "tests/support/command_machine.h"
#include "tests/support/multiplexed_machine.h"

namespace knuckle::slave {
namespace {

/// An arm of 0.9 rad/s at the full command. Its lever is positive: what extends turns it up.
struct WatchedArm {
  explicit WatchedArm(const char* commands = test::kRateCommands) : WatchedArm(test::command_machine(commands)) {}
  explicit WatchedArm(const MachineDescription& of) : machine(of) {
    state.lever_m.setConstant(0.3);
    state.pressure_Pa.fill(50e5);
  }
  Reason step(double demand, double rate_radps, bool pressed = false) {
    state.angle_rad[kArm] += rate_radps * 5e-3;
    return monitor.step(JointVector(0, demand, 0), state, pressed);
  }
  /// Seconds until a fault; 0 where there is none in a minute.
  double until_fault(double demand, double rate_radps, bool pressed = false) {
    for (int i = 1; i <= 12000; ++i) {
      const Reason why = step(demand, rate_radps, pressed);
      if (!why) continue;
      EXPECT_TRUE(test::is(why, ReasonCode::kMotionNotFollowing, kArm));
      return i * 5e-3;
    }
    return 0;
  }
  MachineDescription machine;
  MotionMonitor monitor{machine, 5e-3};
  estimation::JointState state;
};

TEST(MotionMonitor, SaysNothingOfASoundJoint) {
  for (const double gain : {0.75, 1.25}) {
    WatchedArm arm;
    std::mt19937 random(7);
    std::normal_distribution<> noise(0, 2e-4);
    double lagged = 0, angle = 0;
    for (int i = 0; i < 24000; ++i) {
      const double demand = 0.8 * std::sin(0.02 * i) * std::sin(0.0007 * i);
      lagged += 5e-3 / 0.15 * (gain * 0.9 * demand - lagged);
      angle += lagged * 5e-3;
      arm.state.angle_rad[kArm] = angle + noise(random);
      ASSERT_FALSE(arm.monitor.step(JointVector(0, demand, 0), arm.state, false)) << i;
    }
  }
}

TEST(MotionMonitor, FindsMotionThatNobodyAskedForHoweverSlow) {
  for (const double rate : {0.05, 0.2, 0.5, -0.05, -0.2, -0.5}) {
    WatchedArm arm;
    ASSERT_EQ(WatchedArm().until_fault(0, 0), 0);
    const double found_s = arm.until_fault(0, rate);
    EXPECT_GT(found_s, 0) << rate;
    EXPECT_LE(std::abs(rate) * found_s, 0.15 + 0.02 * found_s + std::abs(rate) * 0.41) << rate;
  }
  EXPECT_EQ(WatchedArm().until_fault(0, 0.015), 0) << "a load that sinks";
}

TEST(MotionMonitor, FindsAnAngleThatStandsInItsLastBitAlsoWhereSomethingSeemsToBeTouched) {
  WatchedArm frozen;
  const double found_s = frozen.until_fault(0.5, 0, true);
  EXPECT_GT(found_s, 0.8);
  EXPECT_LT(found_s, 1.2) << "0.4 s, then 0.45 rad/s of which half less 0.02 counts";
  WatchedArm swinging;  // told one way and the other, each too short for what is missing
  int steps = 0;
  while (steps < 12000 && !swinging.step(std::sin(0.06 * steps) > 0 ? 0.5 : -0.5, 0, true)) ++steps;
  EXPECT_LT(steps * 5e-3, 1.2);
  EXPECT_EQ(WatchedArm().until_fault(0.04, 0, true), 0) << "what no valve opens by";
  WatchedArm pressing;  // gives way by a bit of the encoder now and then
  for (int i = 0; i < 12000; ++i) {
    if (i % 60 == 0) pressing.state.angle_rad[kArm] += i % 120 == 0 ? 4e-4 : -4e-4;
    ASSERT_FALSE(pressing.step(0.5, 0, true)) << i;
  }
  WatchedArm held;  // by something that does not give way: its oil tells
  held.state.pressure_Pa.fill(0.9 * held.machine.hydraulics.main_relief_Pa);
  EXPECT_EQ(held.until_fault(0.5, 0, true), 0);
}

TEST(MotionMonitor, SaysNothingOfAJointThatIsStoppedOrMovesByLessThanItsEncoderSees) {
  for (const double demand : {1.0, -1.0}) {  // stood against a stop at full command, then let go
    WatchedArm stopped;
    stopped.state.pressure_Pa[demand > 0 ? 2 : 3] = 0.9 * stopped.machine.hydraulics.main_relief_Pa;
    ASSERT_EQ(stopped.until_fault(demand, 0, true), 0);
    EXPECT_EQ(stopped.until_fault(0, 0), 0) << demand;
  }
  WatchedArm moving;
  for (int i = 0; i < 200; ++i) ASSERT_FALSE(moving.step(1, 0.9));
  EXPECT_EQ(moving.until_fault(0, 0), 0);
  const std::string fine = "arm_angle = { start = 16, bits = 16, scale = 0.0004",
                    coarse = "arm_angle = { start = 16, bits = 16, scale = 0.012";
  WatchedArm trembling(parse_machine(test::replaced(test::command_text(), fine, coarse), "m.toml"));
  for (int i = 0; i < 12000; ++i) ASSERT_FALSE(trembling.step(0.11 * std::sin(0.094 * i), 0)) << i;
}

TEST(MotionMonitor, FindsMotionAgainstTheCommand) {
  for (const char* commands : {test::kRateCommands, test::kPilotCommands}) {
    WatchedArm arm(commands);
    const double found_s = arm.until_fault(0.5, -0.3);
    EXPECT_GT(found_s, 0);
    EXPECT_LT(found_s, 1);
  }
  EXPECT_EQ(WatchedArm(test::kPilotCommands).until_fault(0.5, 0.5), 0) << "how fast is not known";
}

TEST(MotionMonitor, FindsAJointThatStandsUnlessSomethingHoldsIt) {
  const double found_s = WatchedArm().until_fault(0.3, 0);
  EXPECT_GT(found_s, 0);
  EXPECT_LT(found_s, 1.1);
  EXPECT_GT(WatchedArm().until_fault(0.02, 0), 0) << "however slowly it was told";
  WatchedArm held;
  held.state.pressure_Pa[2] = 300e5;
  EXPECT_EQ(held.until_fault(0.3, 0), 0);
  WatchedArm unknown;
  unknown.state.pressures_known[kArm] = false;
  const double later_s = unknown.until_fault(0.3, 0);
  EXPECT_GT(later_s, found_s) << "nobody knows what holds it";
  EXPECT_LT(later_s, 2);
}

/// A bucket of 20 t, curled in, of 7 cm of lever.
TEST(MotionMonitor, AJointThatSwingsOnItsOilIsNoValvesDoing) {
  const MachineDescription machine = load_machine(find_config("machine", "standard200"));
  const Kinematics kinematics(machine);
  const auto finds = [&](bool by_oil) {
    MotionMonitor monitor(machine, 5e-3);
    estimation::JointState state;
    state.angle_rad = middle_of_range(machine);
    state.pressure_Pa.fill(50e5);
    for (int step = 0; step < 2000; ++step) {
      const double swing_rad = 0.15 * std::sin(2 * std::numbers::pi * 1.5 * 5e-3 * step);
      state.angle_rad[kBucket] = -2.2 + swing_rad;
      const CylinderState at = kinematics.cylinder_at(kBucket, state.angle_rad[kBucket]).value();
      state.lever_m[kBucket] = at.lever_m;
      const double k = oil_stiffness_N_per_m(machine.cylinders[kBucket], machine.hydraulics, at.length_m);
      state.cylinder_N[kBucket] = by_oil ? -k * at.lever_m * swing_rad : 0;
      if (monitor.step(JointVector::Zero(), state, false)) return true;
    }
    return false;
  };
  EXPECT_TRUE(finds(false));
  EXPECT_FALSE(finds(true));
}

/// Where a lever becomes too short to tell, what the oil gives way fades: a step of it would be travel.
TEST(MotionMonitor, AJointThatALoadPushesThroughItsReliefIsNoValvesDoing) {
  for (const double lever_m : {0.3, -0.3}) {
    for (const std::size_t side : {0UL, 1UL}) {  // head, rod
      WatchedArm arm;
      arm.state.lever_m.setConstant(lever_m);
      arm.state.pressure_Pa[2 * kArm + side] = 0.99 * arm.machine.hydraulics.port_relief_Pa;
      const double pushed_radps = (side == 0) == (lever_m > 0) ? -0.3 : 0.3;
      EXPECT_EQ(arm.until_fault(0, pushed_radps), 0) << lever_m << ", " << side;
      EXPECT_GT(arm.until_fault(0, -pushed_radps), 0) << "the other way " << lever_m << ", " << side;
    }
  }
}

TEST(MotionMonitor, WhatTheOilGivesWayIsContinuousTowardsAToggle) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  const Kinematics kinematics(machine);
  double last_rad = given_way_rad(machine, kinematics, kBucket, -2.5, 3e4), most_rad = 0;
  EXPECT_EQ(last_rad, 0) << "16 mm of lever";
  for (double angle_rad = -2.5; angle_rad < -1.5; angle_rad += 1e-3) {
    const double now_rad = given_way_rad(machine, kinematics, kBucket, angle_rad, 3e4);
    EXPECT_LT(std::abs(now_rad - last_rad), 1e-3) << angle_rad;
    most_rad = std::max(most_rad, std::abs(now_rad));
    last_rad = now_rad;
  }
  EXPECT_GT(most_rad, 0.01);
}

/// Else nobody could ever go on without starting anew.
TEST(MotionMonitor, ForgetsOnceTheJointStandsAndNobodyAsksForMotion) {
  for (const auto& [demand, rate] : {std::pair(0.3, 0.0), {0.0, 0.5}}) {
    WatchedArm arm;
    ASSERT_GT(arm.until_fault(demand, rate), 0);
    for (int i = 0; i < 200; ++i) (void)arm.step(demand, rate);  // it goes on for a second
    int steps = 0;
    while (arm.step(0, 0) && steps < 12000) ++steps;
    EXPECT_LT(steps * 5e-3, 2) << demand;
  }
}

TEST(MotionMonitor, BeginsAnewAfterAReset) {
  WatchedArm arm;
  for (int i = 0; i < 120; ++i) (void)arm.step(0, 0.2);
  arm.monitor.reset();
  arm.state.angle_rad[kArm] += 1;
  for (int i = 0; i < 200; ++i) ASSERT_FALSE(arm.step(0, 0));
}

}  // namespace
}  // namespace knuckle::slave
