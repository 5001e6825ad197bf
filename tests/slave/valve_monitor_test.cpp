// The loop's own watch on the spools, to the sample and across its borders.
#include "slave/valve_monitor.h"

#include <gtest/gtest.h>

#include <cmath>

namespace knuckle::slave {
namespace {

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
    EXPECT_EQ(why.code, ReasonCode::kValveNotFollowing);
    EXPECT_EQ(why.subject, kArm);
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
