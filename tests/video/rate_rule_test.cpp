// Pictures yield to what leads the machine.
#include "video/rate_rule.h"

#include <gtest/gtest.h>

#include "video/sender.h"

namespace knuckle::video {
namespace {

class RateRuleFor4000 : public testing::Test {
 protected:
  int run(Duration time, Duration round_trip, bool silent = false) {
    int rate = 0;
    for (const Time until = now_ + time; now_ < until; now_ += 20ms) {
      if (!silent) heard_at_ = now_;
      rate = rule_.step(now_, heard_at_, round_trip, silent);
    }
    return rate;
  }
  /// What the link says from the last message of one operator to the first of another.
  void hand_over(Duration gap, Duration round_trip_before) {
    constexpr Duration kSilent = 200ms;
    rule_.begin();
    for (const Time until = now_ + gap; now_ < until; now_ += 20ms)
      (void)rule_.step(now_, heard_at_, round_trip_before, now_ - heard_at_ > kSilent);
  }
  Time heard_at_{10s};
  RateRule rule_{4000};
  Time now_{10s};
};

TEST_F(RateRuleFor4000, IsHalvedAndHalvedAgainEverySecondWhileAQueueStandsOnThePath) {
  (void)run(10s, 30ms);
  EXPECT_EQ(run(280ms, 300ms), 4000);
  EXPECT_EQ(run(40ms, 300ms), 2000);
  EXPECT_EQ(run(900ms, 300ms), 2000);
  EXPECT_EQ(run(200ms, 300ms), 1000);
  EXPECT_EQ(run(10s, 300ms), kLeastRate_kbps) << "never nothing";
}

TEST_F(RateRuleFor4000, IsHalvedWhereNobodyAnswers) {
  (void)run(10s, 30ms);
  EXPECT_EQ(run(20ms, 30ms, true), 2000);
}

TEST_F(RateRuleFor4000, IsNotMovedByJitterNorByAMessageThatComesLateAlone) {
  for (int i = 0; i < 500; ++i) {
    (void)run(20ms, 30ms);
    EXPECT_EQ(run(20ms, 300ms), 4000);
  }
  for (int i = 0; i < 100; ++i) {
    (void)run(4s, 30ms);
    EXPECT_EQ(run(60ms, 180ms), 4000);
  }
}

TEST_F(RateRuleFor4000, KnowsNothingOfThePathOfTheOperatorBefore) {
  (void)run(10s, 10ms);
  hand_over(300ms, 10ms);
  EXPECT_EQ(run(10s, 450ms), 4000);
}

TEST_F(RateRuleFor4000, IsHalvedWhereTheNextOperatorIsNeverHeard) {
  (void)run(10s, 10ms);
  hand_over(900ms, 10ms);
  EXPECT_EQ(run(20ms, 10ms, true), 4000);
  hand_over(3s, 10ms);
  EXPECT_LT(run(20ms, 10ms, true), 2001);
}

TEST_F(RateRuleFor4000, RecoversSlowly) {
  (void)run(10s, 30ms);
  ASSERT_EQ(run(320ms, 140ms), 2000);
  EXPECT_EQ(run(4900ms, 30ms), 2000);
  EXPECT_LT(run(4s, 30ms), 2700);
  EXPECT_EQ(run(30s, 30ms), 4000);
}

TEST_F(RateRuleFor4000, AcceptsAPathThatHasBecomeLonger) {
  (void)run(10s, 30ms);
  ASSERT_LT(run(5s, 180ms), 1000);
  EXPECT_EQ(run(300s, 180ms), 4000);
}

}  // namespace
}  // namespace knuckle::video
