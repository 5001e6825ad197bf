// Spools held against what their machine was told: as valves say where they are, by the pilot pressures that move them,
// and these against the joint's position.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "machine/reason_text.h"
#include "slave/pilot_monitor.h"
#include "slave/pilot_or_position.h"
#include "slave/valve_monitor.h"
#include "tests/slave/reasons.h"
#include "tests/support/command_machine.h"

namespace knuckle::slave {
namespace {

struct WatchedPilots {
  explicit WatchedPilots(const char* commands)
      : machine(parse_machine(test::command_text(commands, test::state_with_pilots()), "m.toml")) {}
  Reason step(double demand, double opening) {
    return monitor.step(JointVector(0, demand, 0), JointVector(0, opening, 0));
  }
  /// Seconds until a fault; 0 where there is none in a minute.
  double until_fault(double demand, double opening) {
    for (int i = 1; i <= 12000; ++i) {
      const Reason why = step(demand, opening);
      if (!why) continue;
      EXPECT_TRUE(test::is(why, ReasonCode::kValveNotFollowing, kArm));
      return i * 5e-3;
    }
    return 0;
  }
  MachineDescription machine;
  PilotMonitor monitor{machine, 5e-3};
};

TEST(PilotMonitor, SaysNothingOfPressuresThatFollowLateAndInCoarseSteps) {
  for (const double lag_s : {0.02, 0.06}) {
    WatchedPilots pilots(test::kPilotCommands);
    const ValveDescription& valve = pilots.machine.cylinders[kArm].valve;
    std::mt19937 random(3);
    std::uniform_real_distribution<> in(-1, 1);
    double lagged = 0, demand = 0;
    for (int i = 0; i < 24000; ++i) {
      if (i % 60 == 0) demand = in(random);
      lagged += 5e-3 / lag_s * (demand - lagged);
      const double opening = std::copysign(valve.opening(lagged), lagged);
      ASSERT_FALSE(pilots.step(demand, std::round(opening * 20) / 20)) << i;
    }
  }
}

TEST(PilotMonitor, FindsOneThatDoesNotFollowWithinATenthOfASecond) {
  WatchedPilots open(test::kPilotCommands), shut(test::kPilotCommands);
  EXPECT_NEAR(open.until_fault(0, 0.4), 0.08, 0.006) << "nobody asks for it";
  for (int i = 0; i < 100; ++i) ASSERT_FALSE(shut.step(0.6, 0.55));
  EXPECT_NEAR(shut.until_fault(0.6, 0), 0.08, 0.006);
  EXPECT_GT(shut.until_fault(0.6, -0.5), 0) << "the other way";
}

TEST(PilotMonitor, WhatIsInsideTheDeadBandIsShutHoweverItIsTold) {
  WatchedPilots pilots(test::kPilotCommands);
  EXPECT_EQ(pilots.until_fault(0.11, 0), 0);
  EXPECT_EQ(pilots.until_fault(0.2, 0), 0) << "opens by a tenth";
}

TEST(PilotMonitor, LeavesToAMachineThatKeepsSpeedsHowFarItOpens) {
  for (const double opening : {0.02, 0.3, 0.6, 1.0}) {
    WatchedPilots pilots(test::kRateCommands);
    EXPECT_EQ(pilots.until_fault(0.6, opening), 0) << opening;
  }
  WatchedPilots pilots(test::kRateCommands);
  EXPECT_EQ(pilots.until_fault(0, 0.1), 0) << "it may trim";
  EXPECT_EQ(pilots.until_fault(0.3, 0), 0) << "a load that runs ahead is held";
  // The other way for as long as it takes to stop.
  for (int turn = 0; turn < 20; ++turn) {
    for (int i = 0; i < 100; ++i) ASSERT_FALSE(pilots.step(0.6, 0.5));
    for (int i = 0; i < 70; ++i) ASSERT_FALSE(pilots.step(-0.6, 0.5)) << "0.35 s";
    for (int i = 0; i < 30; ++i) ASSERT_FALSE(pilots.step(-0.6, -0.5));
  }
}

TEST(PilotMonitor, FindsOneThatOpensWhereNobodyAsksForItWhateverTheMachineKeeps) {
  WatchedPilots still(test::kRateCommands), against(test::kRateCommands);
  for (int i = 0; i < 200; ++i) ASSERT_FALSE(still.step(0, 0));
  EXPECT_NEAR(still.until_fault(0, -0.3), 0.2, 0.011);
  EXPECT_NEAR(against.until_fault(0.4, -0.3), 0.4, 0.011);
}

TEST(PilotMonitor, FindsOneThatStaysShutWhereHalfOfTheSpeedIsAsked) {
  WatchedPilots pilots(test::kRateCommands);
  EXPECT_NEAR(pilots.until_fault(-0.5, 0), 0.4, 0.011);
}

constexpr double kShut_Pa = 1e5, kOpen_Pa = 20e5;

/// The arm, in steps of 5 ms.
struct Arm {
  explicit Arm(const std::string& commands, const std::string& state = test::state_with_pilots())
      : machine(parse_machine(test::command_text(commands, state), "m.toml")) {}
  void step(double demand, double extend_Pa, double retract_Pa, double time_s) {
    Piloting piloting{.demand = JointVector(0, demand, 0)};
    piloting.pressure_Pa[2 * kArm] = extend_Pa;
    piloting.pressure_Pa[2 * kArm + 1] = retract_Pa;
    for (double t = 0; t < time_s; t += 5e-3) wrong.step(piloting);
  }
  [[nodiscard]] std::string named(std::uint8_t subject) const {
    return subject_text(Reason{ReasonCode::kSensorImplausible, subject}, machine.bus);
  }
  [[nodiscard]] std::string of_open(int direction) const { return named(wrong.of_open(kArm, direction)); }
  [[nodiscard]] std::string of_shut(int direction) const { return named(wrong.of_shut(kArm, direction)); }
  MachineDescription machine;
  PilotOrPosition wrong{machine, 5e-3};
};

constexpr const char *kAngle = "front_angle (0x18FF1021), arm_angle",
                     *kExtend = "pilot_pressure (0x18FF5021), arm_extend_pilot",
                     *kRetract = "pilot_pressure (0x18FF5021), arm_retract_pilot";

/// Of a machine that is led by joint speeds, or by pilot pressures.
class PilotOrPositionOf : public testing::TestWithParam<bool> {
 protected:
  [[nodiscard]] static const char* commands() { return GetParam() ? test::kRateCommands : test::kPilotCommands; }
};

TEST_P(PilotOrPositionOf, AnOpenSpoolThatWasAskedForNamesThePosition) {
  for (const double demand : {0.3, 1.0}) {
    Arm arm(commands());
    arm.step(demand, kOpen_Pa, 0, 2);
    EXPECT_EQ(arm.of_open(1), kAngle) << "however steady the pressure is";
    arm.step(-demand, 0, kOpen_Pa, 2);
    EXPECT_EQ(arm.of_open(-1), kAngle);
  }
}

TEST_P(PilotOrPositionOf, AnOpenSpoolThatNobodyAskedForNamesTheReading) {
  Arm arm(commands());
  arm.step(1, kOpen_Pa, 0, 2);
  arm.step(0, kOpen_Pa, 0, 0.095);
  EXPECT_EQ(arm.of_open(1), kAngle) << "a pressure that falls";
  arm.step(0, kOpen_Pa, 0, 0.02);
  EXPECT_EQ(arm.of_open(1), kExtend);
  arm.step(-1, kOpen_Pa, 0, 0.2);
  EXPECT_EQ(arm.of_open(1), kExtend) << "the other way was";
  arm.step(0, 0, kOpen_Pa, 0.2);
  EXPECT_EQ(arm.of_open(-1), kRetract);
}

TEST_P(PilotOrPositionOf, AMotionThatNobodyAskedForNamesThePosition) {
  Arm arm(commands());
  arm.step(0, kShut_Pa, kShut_Pa, 0.5);
  EXPECT_EQ(arm.of_shut(1), kAngle);
  EXPECT_EQ(arm.of_shut(-1), kAngle);
}

TEST_P(PilotOrPositionOf, AMotionThatWasAskedForNamesTheReadingThatShutsTheSpool) {
  Arm arm(commands());
  arm.step(1, kShut_Pa, kShut_Pa, 0.5);
  EXPECT_EQ(arm.of_shut(1), kExtend) << "it does not open";
  arm.step(1, kOpen_Pa, kOpen_Pa, 0.5);
  EXPECT_EQ(arm.of_shut(1), kRetract) << "it holds against one that does";
  arm.step(-1, kOpen_Pa, kOpen_Pa, 0.5);
  EXPECT_EQ(arm.of_shut(-1), kExtend);
}

TEST_P(PilotOrPositionOf, WithoutPilotPressuresItIsThePosition) {
  Arm arm(commands(), test::kStateBroadcast);
  arm.step(0, kOpen_Pa, 0, 1);
  EXPECT_EQ(arm.of_open(1), kAngle);
  EXPECT_EQ(arm.of_shut(1), kAngle);
}

INSTANTIATE_TEST_SUITE_P(Kinds, PilotOrPositionOf, testing::Bool(),
                         [](const auto& kind) { return kind.param ? "JointRate" : "PilotPressure"; });

constexpr double kValveStep_s = 0.005;
constexpr int kWindow = 20, kPatience = 20;  // steps in 100 ms

JointVector arm(double value) {
  return JointVector(0, value, 0);
}
/// Steps until the monitor speaks; `most` if it does not.
int steps_until(ValveMonitor& monitor, const JointVector& demand, const JointVector& spool, int most = 400) {
  for (int i = 0; i < most; ++i) {
    if (monitor.step(demand, spool)) return i;
  }
  return most;
}

TEST(ValveMonitor, NamesTheJointWhoseSpoolStaysBesideItsDemandForSoLong) {
  for (const double sign : {1.0, -1.0}) {
    ValveMonitor monitor(kValveStep_s);
    EXPECT_NEAR(steps_until(monitor, arm(0), arm(0.3 * sign)), kPatience, 1);
    const Reason why = monitor.step(arm(0), arm(0.3 * sign));
    EXPECT_TRUE(test::is(why, ReasonCode::kValveNotFollowing, kArm));
    EXPECT_NEAR(why.value, 0.3, 1e-6);
    EXPECT_FALSE(monitor.step(arm(0), arm(0.05 * sign))) << "it is back";
  }
}

TEST(ValveMonitor, SpeaksBeyondATenthOfTheStrokeOnly) {
  ValveMonitor within(kValveStep_s), beyond(kValveStep_s);
  EXPECT_EQ(steps_until(within, arm(0.4), arm(0.301)), 400);
  EXPECT_NEAR(steps_until(beyond, arm(0.4), arm(0.299)), kPatience + kWindow, 2) << "demands of before the test are 0";
}

TEST(ValveMonitor, ASpoolMayBeWhereAnyDemandOfTheLastTenthOfASecondWas) {
  ValveMonitor monitor(kValveStep_s);
  for (int i = 0; i < 2000; ++i) {  // as fast as the gate lets a demand move, 60 ms late
    const auto demand = [](int at) { return std::sin(0.03 * at); };
    EXPECT_FALSE(monitor.step(arm(demand(i)), arm(demand(std::max(0, i - 12))))) << i;
  }
}

TEST(ValveMonitor, SpoolThatStaysWhereItWasWhileItsDemandReturnsIsFound) {
  ValveMonitor monitor(kValveStep_s);
  for (int i = 0; i < 100; ++i) ASSERT_FALSE(monitor.step(arm(0.5), arm(0.5)));
  EXPECT_NEAR(steps_until(monitor, arm(0), arm(0.5)), kWindow + kPatience, 2);
}

TEST(ValveMonitor, ForgetsWhatWasBeforeAReset) {
  ValveMonitor monitor(kValveStep_s);
  for (int i = 0; i < kPatience - 2; ++i) ASSERT_FALSE(monitor.step(arm(0), arm(0.3)));
  monitor.reset();
  EXPECT_NEAR(steps_until(monitor, arm(0), arm(0.3)), kPatience, 1);
}

}  // namespace
}  // namespace knuckle::slave
