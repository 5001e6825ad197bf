// Keyboard, gamepad and mouse as hands, at and around every bound.
#include "app/console/hand_input.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "app/console/keys.h"
#include "machine/load.h"

namespace knuckle::console {
namespace {

GamepadState pad_with(GamepadState::Axis axis, float value) {
  GamepadState state;
  state.axes[axis] = value;
  return state;
}

TEST(Keyboard, EachKeyMovesItsJointAndOppositeKeysCancelAndWithoutOneNobodyIsThere) {
  HeldKeys keys;
  keys.boom_up = keys.arm_in = keys.bucket_out = true;
  const HandInput hand = hand_from_keys(keys);
  EXPECT_EQ(hand.rate_radps, JointVector(kFullRate_radps[0], -kFullRate_radps[1], kFullRate_radps[2]));
  EXPECT_TRUE(hand.presence);
  EXPECT_FALSE(hand.enable);
  keys.boom_down = keys.arm_out = keys.bucket_in = true;
  EXPECT_EQ(hand_from_keys(keys).rate_radps, JointVector(JointVector::Zero()));
  const HandInput nobody = hand_from_keys({});
  EXPECT_FALSE(nobody.presence || nobody.enable || nobody.clutch);
  EXPECT_TRUE(nobody.rate_radps.isZero());
  HeldKeys slow;
  slow.slow = true;
  EXPECT_FALSE(hand_from_keys(slow).presence) << "slow is no hand on the machine";
  slow.boom_down = true;
  EXPECT_DOUBLE_EQ(hand_from_keys(slow).rate_radps[kBoom], -kSlowShare * kFullRate_radps[kBoom]);
}

TEST(Keys, NoTwoActionsShareAKey) {
  for (const KeyBinding& a : kKeys) {
    for (const KeyBinding& b : kKeys) {
      const bool same = a.key == b.key && (a.held != nullptr || b.held != nullptr || a.control == b.control);
      EXPECT_EQ(same, &a == &b) << a.what << " / " << b.what;
    }
  }
}

TEST(Gamepad, StickIsNobodyInTheDeadZoneThenGrowsWithoutAJumpUpToFullRateAndNeverLeadsBeyondIt) {
  for (double at = -kStickDeadZone; at <= kStickDeadZone; at += 1e-3) EXPECT_EQ(stick_share(at), 0) << at;
  EXPECT_FALSE(hand_from_gamepad(pad_with(GamepadState::kRightY, 0.149F)).hand.presence);
  EXPECT_TRUE(hand_from_gamepad(pad_with(GamepadState::kRightY, 0.151F)).hand.presence);
  double last = 0;
  for (double at = kStickDeadZone; at <= 1; at += 1e-3) {
    const double share = stick_share(at);
    EXPECT_GE(share, last) << at;
    EXPECT_LT(share - last, 4e-3) << at;
    EXPECT_EQ(stick_share(-at), -share);
    last = share;
  }
  EXPECT_DOUBLE_EQ(stick_share(1), 1);
  EXPECT_DOUBLE_EQ(stick_share(1.7), 1);
  EXPECT_DOUBLE_EQ(stick_share(-1e30), -1);
  for (const double odd : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    EXPECT_EQ(stick_share(odd), 0);
  EXPECT_LT(stick_share(0.5), 0.3);  // fine near the middle
}

TEST(Gamepad, SticksAreThoseOfAnExcavator) {
  // Stick back is +1 in what GLFW reports.
  const auto rates = [](GamepadState::Axis axis) { return hand_from_gamepad(pad_with(axis, 1)).hand.rate_radps; };
  EXPECT_EQ(rates(GamepadState::kRightY), JointVector(kFullRate_radps[0], 0, 0));  // back: boom up
  EXPECT_EQ(rates(GamepadState::kLeftY), JointVector(0, -kFullRate_radps[1], 0));  // back: arm in
  EXPECT_EQ(rates(GamepadState::kRightX), JointVector(0, 0, kFullRate_radps[2]));  // right: bucket out
  for (const auto axis : {GamepadState::kLeftX, GamepadState::kLeftTrigger, GamepadState::kRightTrigger})
    EXPECT_TRUE(rates(axis).isZero());
}

TEST(Gamepad, EachButtonHasItsOneMeaning) {
  for (std::size_t button = 0; button < GamepadState::kButtons; ++button) {
    GamepadState state;
    state.buttons[button] = 1;
    const GamepadHand pad = hand_from_gamepad(state);
    EXPECT_EQ(pad.hand.enable, button == GamepadState::kRightBumper);
    EXPECT_EQ(pad.hand.clutch, button == GamepadState::kLeftBumper);
    EXPECT_EQ(pad.stop, button == GamepadState::kB);
    EXPECT_EQ(pad.hand.presence, pad.hand.enable || pad.hand.clutch);
    EXPECT_TRUE(pad.hand.rate_radps.isZero());
  }
}

TEST(Mouse, DragMovesTheTipTowardsTheMouseAndKeepsTheBucketLevel) {
  const Kinematics kinematics(load_machine(find_config("machine", "solar015")));
  const JointVector pose{0.3, -1.4, -0.9};
  for (const PlanarVector& drag_m : {PlanarVector(0.1, 0), PlanarVector(0, 0.1), PlanarVector(-0.05, -0.08)}) {
    const HandInput hand = hand_from_drag(drag_m, pose, kinematics);
    EXPECT_TRUE(hand.presence);
    EXPECT_FALSE(hand.enable);
    const PlanarVector tip_mps = kinematics.tip_jacobian(pose) * hand.rate_radps;
    EXPECT_GT(tip_mps.normalized().dot(drag_m.normalized()), 0.98);
    EXPECT_LT(std::abs(hand.rate_radps.sum()), 0.1 * hand.rate_radps.norm());
  }
}

TEST(Mouse, DragOfAnyLengthInAnyPoseStaysWithinFullRates) {
  const Kinematics kinematics(load_machine(find_config("machine", "solar015")));
  std::mt19937_64 random(7);
  std::uniform_real_distribution<> unit(-1, 1);
  for (int i = 0; i < 2000; ++i) {
    const PlanarVector drag_m = PlanarVector(unit(random), unit(random)) * std::pow(10.0, 3 * unit(random));
    const JointVector pose{0.3 + 0.7 * unit(random), -1.5 + unit(random), -0.9 + 1.6 * unit(random)};
    const JointVector rate_radps = hand_from_drag(drag_m, pose, kinematics).rate_radps;
    ASSERT_TRUE(rate_radps.allFinite());
    for (int j = 0; j < kJoints; ++j) ASSERT_LE(std::abs(rate_radps[j]), kFullRate_radps[j] * (1 + 1e-9));
  }
  const PlanarVector nowhere(std::numeric_limits<double>::quiet_NaN(), 0);
  EXPECT_FALSE(hand_from_drag(nowhere, JointVector(0.3, -1.4, -0.9), kinematics).presence);
}

TEST(TwoHands, TogetherTheyHoldWhatEitherHoldsAndRaceNoJoint) {
  HandInput a, b;
  a.presence = a.enable = true;
  b.clutch = true;
  a.rate_radps = b.rate_radps = kFullRate_radps;
  const HandInput both = together(a, b);
  EXPECT_TRUE(both.presence && both.enable && both.clutch);
  EXPECT_TRUE(both.rate_radps.isApprox(kFullRate_radps));
}

}  // namespace
}  // namespace knuckle::console
