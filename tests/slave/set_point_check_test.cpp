// What a hand can do, stated again as numbers, and swept across each border.
#include "slave/set_point_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/units.h"
#include "tests/slave/reasons.h"
#include "tests/slave/test_machine.h"
#include "tests/support/no_alloc.h"

namespace knuckle::slave {
namespace {

const JointVector kMin(-0.474, -2.585, -2.5), kMax(1.092, -0.510, 0.784);
const JointVector kMiddle = (kMin + kMax) / 2;

/// An operator's side that sends every two milliseconds.
class Sender {
 public:
  /// The next message, `gap` after the last one.
  Reason send(const JointVector& position, const JointVector& velocity, Duration gap = 2ms, bool clutch = false) {
    MasterMessage message;
    message.stamp.sent_at = at_ += gap;
    message.position_rad = position;
    message.velocity_radps = velocity;
    message.clutch = clutch;
    const SetPointVerdict verdict = check_set_point(message, memory_, limits_, machine);
    memory_ = verdict.memory;
    return verdict.reason;
  }
  Reason send(double boom, double boom_rate, Duration gap = 2ms) {
    return send(JointVector(boom, kMiddle[1], kMiddle[2]), JointVector(boom_rate, 0, 0), gap);
  }
  /// Stands, known to the other side.
  static Sender standing(const JointVector& position = kMiddle) {
    Sender s;
    EXPECT_FALSE(s.send(position, JointVector::Zero()));
    return s;
  }

  JointVector machine = kMiddle;

 private:
  SetPointLimits limits_{test::test_machine()};
  SetPointMemory memory_;
  Time at_{5s};
};

JointVector only(int joint, double value, const JointVector& rest = JointVector::Zero()) {
  JointVector v = rest;
  v[joint] = value;
  return v;
}

TEST(SetPointCheck, PositionBelongsIntoTheWorkingRangeWithADegreeToSpare) {
  for (int joint = 0; joint < kJoints; ++joint) {
    for (const bool upper : {false, true}) {
      for (double over = -0.03025; over <= 0.03; over += 0.0005) {
        const double at = upper ? kMax[joint] + over : kMin[joint] - over;
        Sender s;  // the first message: nothing to compare with
        const Reason reason = s.send(only(joint, at, kMiddle), JointVector::Zero());
        EXPECT_TRUE(test::is(reason, over > 0.0175 ? ReasonCode::kSetpointRange : ReasonCode::kNone))
            << joint << " " << over;
        if (!reason) continue;
        const double bound = upper ? kMax[joint] + 0.0175 : kMin[joint] - 0.0175;
        test::expect_reason(reason, ReasonCode::kSetpointRange, joint, at / kDegree, bound / kDegree, 5e-6);
      }
    }
  }
}

TEST(SetPointCheck, MachineThatStandsBeyondItsRangeCanBeLedBackButNoFurther) {
  for (int joint = 0; joint < kJoints; ++joint) {
    for (const bool upper : {false, true}) {
      const double side = upper ? 1 : -1, stands = (upper ? kMax[joint] : kMin[joint]) + 0.1 * side;
      for (double beyond = -0.20125; beyond <= 0.1; beyond += 0.0025) {
        Sender s;
        s.machine = only(joint, stands, kMiddle);
        const Reason reason = s.send(only(joint, stands + beyond * side, kMiddle), JointVector::Zero());
        EXPECT_TRUE(test::is(reason, beyond > 0.0175 ? ReasonCode::kSetpointRange : ReasonCode::kNone))
            << joint << " " << beyond;
      }
    }
  }
}

TEST(SetPointCheck, SpeedIsNoneThatAHandHasNot) {
  for (int joint = 0; joint < kJoints; ++joint) {
    for (double rate = -60; rate <= 60; rate += 0.25) {
      Sender s;
      const Reason reason = s.send(kMiddle, only(joint, rate));
      EXPECT_TRUE(test::is(reason, std::abs(rate) > 40 ? ReasonCode::kSetpointSpeed : ReasonCode::kNone)) << rate;
      if (!reason) continue;
      test::expect_reason(reason, ReasonCode::kSetpointSpeed, joint, std::abs(rate), 40, 1e-7);
    }
  }
}

// 40 rad/s over the gap, and 5 deg besides.
TEST(SetPointCheck, PositionChangesNoFasterThanThat) {
  for (const Duration gap : {2ms, 4ms, 20ms}) {
    const double most = 0.0873 + 40 * to_seconds(gap);
    for (double step = 0; step <= 1.2; step += 0.001) {
      // From the end of the range, where the speed that was sent need not explain it.
      Sender s = Sender::standing(kMax);
      const Reason reason = s.send(only(kBucket, kMax[kBucket] - step, kMax), JointVector::Zero(), gap);
      EXPECT_TRUE(test::is(reason, step > most ? ReasonCode::kSetpointJump : ReasonCode::kNone))
          << step << " in " << to_seconds(gap);
    }
  }
}

// 40 rad/s that swing at 9.2 Hz, over 2 ms.
constexpr double kHidden = 40 * (2 * std::numbers::pi * 9.2) * (2 * std::numbers::pi * 9.2) * 8e-9 / 12;

TEST(SetPointCheck, JumpIsOneWhereTheSpeedDoesNotExplainIt) {
  for (int joint = 0; joint < kJoints; ++joint) {
    for (double step = -0.16; step <= 0.16; step += 0.0005) {
      Sender s = Sender::standing();
      const Reason reason = s.send(only(joint, kMiddle[joint] + step, kMiddle), JointVector::Zero());
      EXPECT_TRUE(test::is(reason, std::abs(step) > 0.0873 + kHidden ? ReasonCode::kSetpointJump : ReasonCode::kNone))
          << step;
      if (!reason) continue;
      const double unexplained_deg = (std::abs(step) - kHidden) / kDegree;
      test::expect_reason(reason, ReasonCode::kSetpointJump, joint, unexplained_deg, 0.0873 / kDegree, 1e-6);
    }
  }
}

/// How long a speed can go on while the position stands; 1 s: for ever.
double found_after_s(double rate) {
  Sender s = Sender::standing();
  for (int i = 1; i <= 500; ++i) {
    if (s.send(kMiddle[kBoom], rate).code == ReasonCode::kSetpointJump) return i * 2e-3;
  }
  return 1;
}

TEST(SetPointCheck, SpeedOfAPositionThatStandsIsFoundFromHalfARadianPerSecondOn) {
  EXPECT_EQ(found_after_s(0.42), 1);
  EXPECT_EQ(found_after_s(-0.42), 1);
  for (double rate = 0.5; rate <= 40; rate *= 1.1) {
    EXPECT_LT(found_after_s(rate), 0.8) << rate;
    EXPECT_LT(found_after_s(-rate), 0.8) << rate;
    EXPECT_LE(rate * found_after_s(rate), 0.4) << "before the machine was led far astray";
  }
  EXPECT_LE(found_after_s(40), 0.004);
}

// What a hand can do between two packets that its speed at both does not show: at 9.2 Hz, with up to 40 rad/s, of which
// ends and way show half at least.
TEST(SetPointCheck, GapOfPacketsLeavesRoomForWhatAHandDoesInIt) {
  for (const Duration gap : {2ms, 4ms, 10ms, 20ms, 30ms}) {
    const double t = to_seconds(gap), swing = 2 * std::numbers::pi * 9.2 * t;
    const double most = std::min(0.0873 / (1 - swing * swing / 6), 0.0873 + 40 * swing * swing * t / 12);
    for (const double part : {0.999, 1.001}) {
      Sender s = Sender::standing();
      EXPECT_EQ(static_cast<bool>(s.send(kMiddle[kBoom] + part * most, 0, gap)), part > 1) << to_seconds(gap);
    }
  }
}

TEST(SetPointCheck, WhatAGapHidIsNoCreditForTheNextMessage) {
  Sender s = Sender::standing();
  ASSERT_FALSE(s.send(kMiddle[kBoom] + 0.11, 0, 20ms));
  EXPECT_TRUE(s.send(kMiddle[kBoom] + 0.125, 0));
}

TEST(SetPointCheck, JumpIsToldOnceAndWhereItLedIsTheNewBeginning) {
  Sender s = Sender::standing();
  EXPECT_TRUE(s.send(kMiddle[kBoom] + 0.3, 0));
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(s.send(kMiddle[kBoom] + 0.3, 0)) << i;
}

TEST(SetPointCheck, StampThatStandsStillExplainsNoWay) {
  Sender s = Sender::standing();
  EXPECT_TRUE(s.send(kMiddle[kBoom] + 0.09, 40, 0ms));
}

TEST(SetPointCheck, ClutchMovesASetPointAnywhereWithinRangeAndSpeed) {
  Sender s = Sender::standing();
  const JointVector far = kMiddle + JointVector(0.5, 0.5, 1);
  EXPECT_FALSE(s.send(far, JointVector::Zero(), 2ms, true));
  EXPECT_FALSE(s.send(kMiddle, JointVector::Zero(), 2ms, true));
  EXPECT_FALSE(s.send(far, JointVector::Zero())) << "the first without it";
  EXPECT_TRUE(s.send(kMiddle, JointVector::Zero()));
  EXPECT_TRUE(test::is(s.send(kMiddle, JointVector(0, 0, 41), 2ms, true), ReasonCode::kSetpointSpeed));
  EXPECT_TRUE(test::is(s.send(only(kArm, 0, kMiddle), JointVector::Zero(), 2ms, true), ReasonCode::kSetpointRange));
}

TEST(SetPointCheck, NonFiniteOnesAreNone) {
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    for (int joint = 0; joint < kJoints; ++joint) {
      Sender s = Sender::standing();
      EXPECT_TRUE(s.send(only(joint, bad, kMiddle), JointVector::Zero()));
      s = Sender::standing();
      EXPECT_TRUE(s.send(kMiddle, only(joint, bad)));
    }
  }
}

TEST(SetPointCheck, HandThatPushesOnBeyondTheEndOfTheRangeIsNoJump) {
  // 3 rad/s to and fro across the upper end: the position is held by it, the outward speed is zero, the inward is not.
  Sender s = Sender::standing(only(kBoom, kMax[kBoom] - 0.2, kMiddle));
  double filtered = 0;
  for (int i = 0; i < 3000; ++i) {
    const double t = i * 1e-3, amplitude = 0.25, omega = 12;
    const double hand = kMax[kBoom] - 0.2 + amplitude * (1 - std::cos(omega * t));
    filtered +=
        (1 - std::exp(-2 * std::numbers::pi * 30 * 1e-3)) * (amplitude * omega * std::sin(omega * t) - filtered);
    if (i % 2 != 0) continue;
    const bool outward = hand > kMax[kBoom] && filtered > 0;
    EXPECT_FALSE(s.send(std::min(hand, kMax[kBoom]), outward ? 0 : filtered)) << t;
  }
}

/// A hand: joints that swing at up to 9.2 Hz, its speed low-passed as the operator's side does, packets lost.
TEST(SetPointCheck, NothingThatAHandDoesTripsWhateverIsLost) {
  std::mt19937 rng(17);
  const auto draw = [&rng](double low, double high) { return std::uniform_real_distribution<>(low, high)(rng); };
  for (int run = 0; run < 300; ++run) {
    Sender s;
    const double omega = 2 * std::numbers::pi * draw(0.2, 9.2);
    const JointVector room = (kMax - kMin) / 2;
    const JointVector amplitude = draw(0.1, 0.99) * room.cwiseMin(JointVector::Constant(40 / omega)),
                      phase(draw(0, 6), draw(0, 6), draw(0, 6));
    const double loss = draw(0, 0.5), bursts = draw(0, 0.02);
    int burst = 0;  // messages still to be lost of an outage of up to 150 ms
    JointVector filtered = JointVector::Zero();
    Duration gap{};
    for (int i = 0; i < 2000; ++i) {
      const double t = i * 1e-3;
      JointVector position = kMiddle, velocity;
      for (int j = 0; j < kJoints; ++j) {
        position[j] += amplitude[j] * std::sin(omega * t + phase[j]);
        velocity[j] = amplitude[j] * omega * std::cos(omega * t + phase[j]);
      }
      if (i == 0) filtered = velocity;
      filtered += (1 - std::exp(-2 * std::numbers::pi * 30 * 1e-3)) * (velocity - filtered);
      gap += 1ms;
      if (i % 2 != 0) continue;
      if (burst == 0 && draw(0, 1) < bursts) burst = static_cast<int>(draw(1, 75));
      if (burst > 0) --burst;
      if (burst > 0 || draw(0, 1) < loss) continue;
      const Reason reason = s.send(position, filtered, gap);
      EXPECT_FALSE(reason) << text(reason) << ", run " << run;
      gap = {};
    }
  }
}

TEST(SetPointCheck, AllocatesNothing) {
  Sender s;
  const test::NoAllocScope scope;
  for (int i = 0; i < 100; ++i) (void)s.send(0.01 * i, 40);
  EXPECT_EQ(scope.allocations(), 0U);
}

}  // namespace
}  // namespace knuckle::slave
