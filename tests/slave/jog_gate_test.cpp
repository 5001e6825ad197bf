// The gate of first motions: its limits stated again as numbers and swept across their borders.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/slave/gate_bench.h"
#include "tests/support/no_alloc.h"

namespace knuckle::slave {
namespace {

class JogGate : public JogGateBench {
 protected:
  /// Neutral; as it was, it passes. @return why
  Reason refused() { return refusal_of(gate(only(kArm, 0.2)), now); }
  void expect_passed() {
    const GateResult r = gate(only(kArm, 0.2));
    EXPECT_EQ(r.commands, only(kArm, 0.2));
    EXPECT_FALSE(r.fault) << text(r.fault);
    EXPECT_EQ(r.limits, 0);
  }
};

TEST_F(JogGate, RefusesWhatIsBeyondThirtyFivePercentOfStroke) {
  for (double u = -1.2; u <= 1.2; u += 0.003) {
    if (std::abs(u) > 0.35) {
      expect_reason(refusal_of(gate(only(kArm, u)), now), ReasonCode::kCommandInvalid, kArm, u, 0.35);
      continue;
    }
    EXPECT_FALSE(gate(only(kArm, u)).fault) << u;
    EXPECT_EQ(gate(only(kArm, u)).commands, only(kArm, u)) << u;
  }
  for (const double bad : {kNan, kInf, -kInf})
    EXPECT_TRUE(test::is(refusal_of(gate(only(kArm, bad)), now), ReasonCode::kCommandInvalid));
}

TEST_F(JogGate, RefusesAnyOpeningOfAnotherJoint) {
  for (const int other : {kBoom, kBucket}) {
    for (const double u : {1e-9, -0.1, 0.2, kNan}) {
      const GateResult r = gate(only(kArm, 0.2) + only(other, u));
      expect_reason(refusal_of(r, now), ReasonCode::kCommandInvalid, other, u, 0);
    }
  }
}

TEST_F(JogGate, OpensSlowlyFromZeroAndClosesAtOnce) {
  // 0.2 of stroke per second: 0.001 a step of 5 ms, however small the opening.
  for (const double sign : {-1.0, 1.0}) {
    for (double from = 0; from <= 0.35; from += 0.01) {
      for (double to = 0.0002; to <= 0.35; to += 0.0005) {
        memory = {only(kArm, sign * from), now - 5ms};
        const GateResult r = gate_from_memory(only(kArm, sign * to));
        EXPECT_NEAR(r.commands[kArm], sign * std::min(to, from + 0.001), 1e-12) << from << " " << to;
        EXPECT_EQ((r.limits & kLimitRate) != 0, to > from + 0.001) << from << " " << to;
      }
    }
  }
  memory = {only(kArm, 0.3), now - 5ms};
  EXPECT_NEAR(gate_from_memory(only(kArm, -0.3)).commands[kArm], -0.001, 1e-12) << "through zero";
}

TEST_F(JogGate, LateLoopGetsNoBiggerJumpAndATooLateOneNone) {
  for (Duration gap = 5ms; gap <= 80ms; gap += 1ms) {
    memory = {only(kArm, 0.1), now - gap};
    const GateResult r = gate_from_memory(only(kArm, 0.3));
    if (gap > 50ms) {  // the valve's own watchdog
      expect_reason(refusal_of(r, now), ReasonCode::kLoopOverrun, 0, 1e3 * to_seconds(gap), 50);
    } else {
      EXPECT_NEAR(r.commands[kArm], 0.1 + 0.2 * std::min(to_seconds(gap), 0.020), 1e-12);
    }
  }
  memory = {only(kArm, 0), now - 10s};
  EXPECT_FALSE(gate_from_memory(only(kArm, 0.3)).fault) << "closed valves have no deadline";
}

TEST_F(JogGate, RefusesAMotionOfMoreThanNinetySeconds) {
  for (Duration elapsed = 89s; elapsed <= 91s; elapsed += 5ms) {
    state.since = now - elapsed;
    if (elapsed > 90s)
      expect_reason(refused(), ReasonCode::kJogTooLong, 0, to_seconds(elapsed), 90);
    else
      expect_passed();
  }
  state.since = now;
  expect_passed();
  state.since = now + 1ns;
  EXPECT_TRUE(test::is(refused(), ReasonCode::kJogTooLong));
}

TEST_F(JogGate, RefusesOldFutureAndInvalidSensorsByTheirNode) {
  for (Duration age = 0ms; age < 60ms; age += 100us) {
    state.oldest_at = now - age;
    if (age > 25ms)
      expect_reason(refused(), ReasonCode::kSensorStale, 0x23, 1e3 * to_seconds(age), 25);
    else
      expect_passed();
  }
  state.oldest_at = kNever;
  EXPECT_TRUE(test::is(refused(), ReasonCode::kSensorStale, 0x23));
  for (const Duration ahead : {Duration(1ns), Duration(30ms)}) {
    state.oldest_at = now + ahead;
    expect_reason(refused(), ReasonCode::kSensorInvalid, 0x23, 0, 0);
  }
  state.oldest_at = now;
  state.invalid_subject = 0x21;
  expect_reason(refused(), ReasonCode::kSensorInvalid, 0x21, 1, 0);
}

TEST_F(JogGate, RefusesMotionOfACylinderThatWasNotCommanded) {
  for (const int other : {kBoom, kBucket}) {
    for (double way = -0.02005; way <= 0.02; way += 0.0001) {
      state.travelled_m = only(other, way);
      if (std::abs(way) > 0.01)
        expect_reason(refused(), ReasonCode::kJogOtherMoves, other, 1e3 * std::abs(way), 10);
      else
        expect_passed();
    }
    state.travelled_m = only(other, 0.01);
    expect_passed();
    state.travelled_m = only(other, kNan);
    expect_reason(refused(), ReasonCode::kJogOtherMoves, other, kNan, 10);
    state.travelled_m.setZero();
  }
}

TEST_F(JogGate, RefusesAnyChamberAboveItsPressureLimit) {
  for (std::size_t chamber = 0; chamber < 6; ++chamber) {
    for (double bar = 200; bar <= 260; bar += 0.25) {
      state.pressure_Pa[chamber] = bar * 1e5;
      if (bar > 240)
        expect_reason(refused(), ReasonCode::kPressureLimit, static_cast<int>(chamber), bar, 240);
      else
        expect_passed();
    }
    state.pressure_Pa[chamber] = kNan;
    expect_reason(refused(), ReasonCode::kPressureLimit, static_cast<int>(chamber), kNan, 240);
    state.pressure_Pa[chamber] = 100e5;
  }
}

TEST_F(JogGate, RefusesWhileTheEStopIsOpen) {
  expect_passed();
  state.e_stop_open = true;
  expect_reason(refused(), ReasonCode::kEmergencyStop, 0, 0, 0);
}

TEST_F(JogGate, NeutralAlwaysPasses) {
  state = {};
  state.e_stop_open = true;
  state.pressure_Pa.fill(kNan);
  const GateResult r = gate(only(kArm, 0));
  EXPECT_EQ(r.commands, only(kArm, 0));
  EXPECT_FALSE(r.fault);
}

// Whatever comes in: never more than asked, never the other way, one joint only, and every change is reported.
TEST_F(JogGate, OnlyEverTakesAwayAndNeverSilently) {
  std::mt19937 rng(3);
  const auto draw = [&rng](double low, double high) { return std::uniform_real_distribution<>(low, high)(rng); };
  for (int i = 0; i < 20000; ++i) {
    state.joint = static_cast<int>(draw(0, 2.999));
    for (double& p : state.pressure_Pa) p = draw(0, 245) * 1e5;
    for (double& way : state.travelled_m) way = draw(-0.011, 0.011);
    memory = {only(state.joint, draw(-0.4, 0.4)), now - from_seconds(draw(0, 0.06))};
    JointVector wanted = only(state.joint, draw(-0.4, 0.4));
    if (draw(0, 1) < 0.1) wanted[static_cast<int>(draw(0, 2.999))] = draw(-0.4, 0.4);
    const GateResult r = gate_from_memory(wanted);
    EXPECT_EQ(r.commands == wanted, r.limits == 0 && !r.fault);
    EXPECT_EQ(r.memory.sent, r.commands.value());
    for (int j = 0; j < kJoints; ++j) {
      EXPECT_LE(std::abs(r.commands[j]), j == state.joint ? 0.35 : 0.0);
      EXPECT_LE(std::abs(r.commands[j]), std::abs(wanted[j]));
      EXPECT_GE(r.commands[j] * wanted[j], 0);
    }
  }
}

// A motion passes only as one of commissioning's: of its joint, in its time, with pilot pressure asked for, on fresh
// and valid sensors.
TEST_F(JogGate, NeverOpensOutsideAMotionOfCommissioning) {
  std::mt19937 rng(4);
  const auto draw = [&rng](double low, double high) { return std::uniform_real_distribution<>(low, high)(rng); };
  int opened = 0;
  for (int i = 0; i < 20000; ++i) {
    state.joint = static_cast<int>(draw(-0.999, 2.999));
    if (draw(0, 1) < 0.1) state.joint = JogState::kNoJoint;
    state.since = draw(0, 1) < 0.1 ? kNever : now - from_seconds(draw(-1, 95));
    state.oldest_at = now - from_seconds(draw(-0.002, 0.04));
    state.invalid_subject = draw(0, 1) < 0.1 ? 0x21 : 0;
    state.e_stop_open = draw(0, 1) < 0.1;
    memory = {JointVector::Zero(), now - from_seconds(draw(0, 0.2))};
    const int moved = static_cast<int>(draw(0, 2.999));
    const JointVector wanted = only(moved, draw(-0.4, 0.4));
    const GateResult r = gate_from_memory(wanted);
    const bool planned =
        moved == state.joint && std::abs(wanted[moved]) <= 0.35 && now >= state.since && now - state.since <= 90s;
    const bool sound = state.oldest_at <= now && now - state.oldest_at <= limits.state_age &&
                       state.invalid_subject == 0 && !state.e_stop_open;
    if (planned && sound) {
      ASSERT_FALSE(r.fault) << text(r.fault);
      opened += r.commands[moved] != 0 ? 1 : 0;
    } else {
      ASSERT_EQ(r.commands, JointVector(0, 0, 0)) << i;
      ASSERT_TRUE(r.fault) << i;
    }
  }
  EXPECT_GT(opened, 500) << "or this has tested nothing";
}

TEST_F(JogGate, AllocatesNothing) {
  const test::NoAllocScope scope;
  for (int i = 0; i < 100; ++i) (void)gate(only(kArm, 0.004 * i));
  EXPECT_EQ(scope.allocations(), 0U);
}

}  // namespace
}  // namespace knuckle::slave
