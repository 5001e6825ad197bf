// Spools held against what their machine was told, by the pilot pressures that move them.
#include "slave/pilot_monitor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

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
      EXPECT_EQ(why.code, ReasonCode::kValveNotFollowing);
      EXPECT_EQ(why.subject, kArm);
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

}  // namespace
}  // namespace knuckle::slave
