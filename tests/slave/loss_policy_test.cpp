// Timing of the loss policy, stated again from the design: 20 / 50 / 150 / 200 ms, round trip 500 ms.
#include "slave/loss_policy.h"

#include <gtest/gtest.h>

#include "tests/slave/reasons.h"

namespace knuckle::slave {
namespace {

const JointVector kPosition(0.4, -1.2, 0.1);
const JointVector kVelocity(0.5, -0.25, 1.0);

LossDecision at(Duration age, Duration round_trip = 20ms, bool holding = false) {
  return loss_policy(kPosition, kVelocity, age, age, round_trip, holding);
}

TEST(LossPolicy, TimingTableHoldsOnBothSidesOfEveryBorder) {
  struct Row {
    Duration age;
    LossStage stage;
    double authority;
    double ahead_s;
    bool moving, lost;
  };
  const Row rows[] = {
      {0ms, LossStage::kExtrapolate, 1, 0, true, false},       {20ms, LossStage::kExtrapolate, 1, 0.020, true, false},
      {20ms + 1ns, LossStage::kHold, 1, 0.020, false, false},  {50ms, LossStage::kHold, 1, 0.020, false, false},
      {75ms, LossStage::kRamp, 0.75, 0.020, false, false},     {100ms, LossStage::kRamp, 0.5, 0.020, false, false},
      {149ms, LossStage::kRamp, 0.01, 0.020, false, false},    {150ms, LossStage::kZero, 0, 0.020, false, false},
      {200ms - 1ns, LossStage::kZero, 0, 0.020, false, false}, {200ms, LossStage::kLost, 0, 0.020, false, true},
      {24h, LossStage::kLost, 0, 0.020, false, true},
  };
  for (const Row& row : rows) {
    const LossDecision d = at(row.age);
    const auto ms = to_seconds(row.age) * 1e3;
    EXPECT_EQ(d.stage, row.stage) << ms;
    EXPECT_NEAR(d.authority, row.authority, 1e-12) << ms;
    EXPECT_NEAR((d.position_rad - kPosition - kVelocity * row.ahead_s).norm(), 0, 1e-12) << ms;
    EXPECT_EQ(d.velocity_radps, row.moving ? kVelocity : JointVector(0, 0, 0)) << ms;
    EXPECT_EQ(d.link.code == ReasonCode::kLinkLost, row.lost) << ms;
    EXPECT_FLOAT_EQ(d.link.value, static_cast<float>(row.lost ? ms : 0));
    EXPECT_FLOAT_EQ(d.link.limit, row.lost ? 200 : 0);
    EXPECT_EQ(d.link.subject, 0) << ms;
    EXPECT_EQ(loss_policy(kPosition, kVelocity, row.age, 0ms, 20ms, false).stage, row.stage)
        << "whatever the gap before";
  }
}

TEST(LossPolicy, AuthorityNeverGrowsWithAge) {
  double last = 1;
  for (Duration age = 0ms; age < 250ms; age += 100us) {
    const double authority = at(age).authority;
    EXPECT_LE(authority, last);
    EXPECT_GE(last - authority, 0);
    EXPECT_LE(last - authority, 0.0011);  // no step: 1 over 100 ms
    last = authority;
  }
  EXPECT_EQ(last, 0);
}

TEST(LossPolicy, PacketFromTheFutureCountsAsLost) {
  const LossDecision d = at(-1ns);
  EXPECT_EQ(d.stage, LossStage::kLost);
  EXPECT_EQ(d.authority, 0);
  EXPECT_TRUE(test::is(d.link, ReasonCode::kLinkLost));
}

TEST(LossPolicy, GapAsLongAsTheNeutralAgeIsALossWhateverEndsIt) {
  for (Duration gap = 190ms; gap <= 210ms; gap += 100us) {
    const LossDecision d = loss_policy(kPosition, kVelocity, 0ms, gap, 20ms, false);
    const bool lost = gap >= 200ms;
    EXPECT_TRUE(test::is(d.link, lost ? ReasonCode::kLinkLost : ReasonCode::kNone)) << to_seconds(gap);
    EXPECT_EQ(d.stage, lost ? LossStage::kLost : LossStage::kExtrapolate);
    EXPECT_EQ(d.authority, lost ? 0 : 1);
    EXPECT_EQ(d.velocity_radps, lost ? JointVector(0, 0, 0) : kVelocity);
    if (lost) {
      EXPECT_FLOAT_EQ(d.link.value, static_cast<float>(to_seconds(gap) * 1e3));
    }
  }
}

TEST(LossPolicy, DelayAloneHoldsButIsNoLoss) {
  EXPECT_FALSE(at(5ms, 500ms).hold);
  EXPECT_FALSE(at(5ms, 0ms).hold);
  const LossDecision d = at(5ms, 501ms);
  test::expect_reason(d.hold, ReasonCode::kRoundTripTooLong, 0, 501, 500, 1e-7);
  EXPECT_FALSE(d.link);
  EXPECT_EQ(d.authority, 1);
}

TEST(LossPolicy, HoldForRoundTripEndsOnlyWellBelowItsLimit) {
  EXPECT_TRUE(at(5ms, 451ms, true).hold);
  EXPECT_FALSE(at(5ms, 450ms, true).hold);
  EXPECT_FALSE(at(5ms, 499ms, false).hold);
}

TEST(LossPolicy, EchoFromTheFutureHolds) {
  EXPECT_TRUE(at(5ms, -1ns).hold);
}

}  // namespace
}  // namespace knuckle::slave
