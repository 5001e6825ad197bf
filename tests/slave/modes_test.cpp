// The mode machine, told as stories. A Story keeps everything healthy; each line changes one thing and looks.
#include "slave/modes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "tests/slave/reasons.h"
#include "tests/slave/test_machine.h"

namespace knuckle::slave {
namespace {

constexpr double kDeg = 3.14159265358979323846 / 180;

class Story {
 public:
  Story() {
    in.nodes_operational = in.pilot_on = in.presence = true;
    in.hand_rad = in.machine_rad = JointVector(0.3, -1.5, -0.4);
  }
  Mode step() {
    const ModeDecision d = next_mode(state, in);
    state = d.state;
    blocking = d.blocking;
    return state.mode;
  }
  Mode steps(int n) {
    for (int i = 1; i < n; ++i) step();
    return step();
  }
  /// After so many steps it is in this mode, and shows why.
  testing::AssertionResult comes_to(Mode mode, ReasonCode shown, int after = 1) {
    steps(after);
    return testing::AssertionResult(state.mode == mode && blocking.code == shown)
           << "mode " << static_cast<int>(state.mode) << ", " << name(blocking.code);
  }
  /// The usual way in: released, then pressed, hand on the machine.
  Mode engage() {
    in.enable = false;
    steps(4);
    in.enable = true;
    return steps(3);
  }
  ModeInputs in;
  ModeState state;
  Reason blocking;
};

Reason reason(ReasonCode code, std::uint8_t subject = 0) {
  return {code, subject, 0, 0};
}

TEST(Modes, OperatorTakesOverStepByStepAndEveryWaitNamesItsReason) {
  Story s;
  s.in.nodes_operational = false;
  s.in.presence = false;
  EXPECT_EQ(s.step(), Mode::kSelfTest);
  EXPECT_TRUE(s.comes_to(Mode::kSelfTest, ReasonCode::kStartingUp));
  s.in.nodes_operational = true;
  s.in.sensor_fault = reason(ReasonCode::kSensorStale, 0x21);
  EXPECT_EQ(s.step(), Mode::kSelfTest);
  EXPECT_TRUE(test::is(s.blocking, ReasonCode::kSensorStale, 0x21));
  s.in.sensor_fault = {};
  EXPECT_EQ(s.step(), Mode::kReady);
  s.step();
  EXPECT_TRUE(test::is(s.blocking, ReasonCode::kNoPresence));
  s.in.presence = true;
  s.step();
  EXPECT_TRUE(test::is(s.blocking, ReasonCode::kEnableNotPressed));
  s.in.enable = true;
  EXPECT_EQ(s.step(), Mode::kAligning);
  EXPECT_EQ(s.step(), Mode::kEngaged);
  EXPECT_FALSE(s.blocking);
  s.in.enable = false;
  EXPECT_EQ(s.step(), Mode::kReady);
}

TEST(Modes, HandMustBeWithinFiveDegreesOnEveryJoint) {
  for (int joint = 0; joint < kJoints; ++joint) {
    for (const double sign : {-1.0, 1.0}) {
      Story s;
      s.in.hand_rad[joint] += sign * 5.01 * kDeg;
      EXPECT_EQ(s.engage(), Mode::kAligning);
      test::expect_reason(s.blocking, ReasonCode::kHandNotAligned, joint, 5.01, 5, 1e-6);
      s.in.hand_rad[joint] = s.in.machine_rad[joint] + sign * 4.99 * kDeg;
      EXPECT_EQ(s.step(), Mode::kEngaged);
    }
  }
}

TEST(Modes, ClutchWhileAligningReindexesTheHand) {
  Story s;
  s.in.hand_rad[kArm] += 0.5;
  EXPECT_EQ(s.engage(), Mode::kAligning);
  s.in.clutch = true;
  EXPECT_TRUE(s.comes_to(Mode::kAligning, ReasonCode::kClutchHeld));
  s.in.hand_rad = s.in.machine_rad;  // the clutch offset brings the set-point onto the machine
  EXPECT_EQ(s.step(), Mode::kAligning);
  s.in.clutch = false;
  EXPECT_EQ(s.step(), Mode::kEngaged);
}

TEST(Modes, HandAndMachineMustBeStillToEngage) {
  Story s;
  s.in.hand_radps[kBucket] = -0.101;
  EXPECT_EQ(s.engage(), Mode::kAligning);
  test::expect_reason(s.blocking, ReasonCode::kHandMoving, kBucket, 0.101, 0.1, 9e-7);
  s.in.hand_radps[kBucket] = 0.10;
  s.in.machine_radps[kBoom] = 0.051;
  EXPECT_EQ(s.step(), Mode::kAligning);
  test::expect_reason(s.blocking, ReasonCode::kMachineMoving, kBoom, 0.051, 0.05, 9e-7);
  s.in.machine_radps[kBoom] = 0.05;
  EXPECT_EQ(s.step(), Mode::kEngaged);
}

TEST(Modes, NonFiniteHandNeverEngages) {
  Story s;
  s.in.hand_rad[kBoom] = std::nan("");
  EXPECT_EQ(s.engage(), Mode::kAligning);
  s.in.hand_rad[kBoom] = s.in.machine_rad[kBoom];
  s.in.hand_radps[kArm] = std::nan("");
  EXPECT_EQ(s.step(), Mode::kAligning);
}

TEST(Modes, LongRoundTripKeepsFromAligningAndHoldsALedMachine) {
  Story s;
  s.in.late = reason(ReasonCode::kRoundTripTooLong);
  EXPECT_EQ(s.engage(), Mode::kReady) << "pilot pressure is not for packets that old";
  EXPECT_TRUE(test::is(s.blocking, ReasonCode::kRoundTripTooLong));
  s.in.late = {};
  EXPECT_TRUE(s.comes_to(Mode::kReady, ReasonCode::kEnableHeld, 100)) << "nor was the press";
  s.in.hand_rad[kBoom] += 10 * kDeg;
  EXPECT_EQ(s.engage(), Mode::kAligning);
  s.in.late = reason(ReasonCode::kRoundTripTooLong);
  EXPECT_EQ(s.step(), Mode::kReady);
  s.in.late = {};
  s.in.hand_rad = s.in.machine_rad;
  EXPECT_EQ(s.engage(), Mode::kEngaged);
  s.in.late = reason(ReasonCode::kRoundTripTooLong);
  EXPECT_TRUE(s.comes_to(Mode::kHold, ReasonCode::kRoundTripTooLong));
  s.in.late = {};
  s.in.hand_rad[kBoom] += 6 * kDeg;  // the hand went on meanwhile
  EXPECT_TRUE(s.comes_to(Mode::kHold, ReasonCode::kHandNotAligned));
  s.in.hand_rad = s.in.machine_rad;
  s.in.hand_radps[kArm] = 0.4;  // it passes by
  EXPECT_TRUE(s.comes_to(Mode::kHold, ReasonCode::kHandMoving, 100)) << "motion never resumes by itself";
  s.in.hand_radps.setZero();
  EXPECT_EQ(s.step(), Mode::kEngaged);
}

TEST(Modes, ClutchDuringALongRoundTripIsAnActOfTheOperator) {
  Story s;
  ASSERT_EQ(s.engage(), Mode::kEngaged);
  s.in.late = reason(ReasonCode::kRoundTripTooLong);
  ASSERT_EQ(s.step(), Mode::kHold);
  s.in.hand_radps[kArm] = 0.4;
  s.in.clutch = true;
  ASSERT_EQ(s.step(), Mode::kHold);
  s.in.late = {};
  ASSERT_EQ(s.step(), Mode::kHold);
  EXPECT_TRUE(test::is(s.blocking, ReasonCode::kClutchHeld));
  s.in.clutch = false;
  EXPECT_EQ(s.step(), Mode::kEngaged);
}

TEST(Modes, ClutchHoldsTheMachineAndReleasingItGoesOn) {
  Story s;
  ASSERT_EQ(s.engage(), Mode::kEngaged);
  s.in.clutch = true;
  EXPECT_TRUE(s.comes_to(Mode::kHold, ReasonCode::kClutchHeld));
  s.in.hand_radps[kArm] = 0.4;  // the hand returns, the offset set-point stays
  EXPECT_EQ(s.steps(100), Mode::kHold);
  s.in.clutch = false;
  EXPECT_EQ(s.step(), Mode::kEngaged);
}

TEST(Modes, FaultLatchesUntilReleasePressAndRealignment) {
  Story s;
  ASSERT_EQ(s.engage(), Mode::kEngaged);
  s.in.link_lost = {ReasonCode::kLinkLost, 0, 201, 200};
  EXPECT_EQ(s.step(), Mode::kFault);
  EXPECT_TRUE(test::is(s.state.fault, ReasonCode::kLinkLost));
  s.in.link_lost = {};
  EXPECT_TRUE(s.comes_to(Mode::kFault, ReasonCode::kReleaseToRecover, 1000)) << "nothing may resume by itself";
  s.in.enable = false;
  EXPECT_TRUE(s.comes_to(Mode::kFault, ReasonCode::kEnableNotPressed, 1000));
  s.in.hand_rad[kBoom] += 10 * kDeg;
  s.in.enable = true;
  EXPECT_EQ(s.step(), Mode::kAligning);
  EXPECT_FALSE(s.state.fault);
  EXPECT_EQ(s.steps(100), Mode::kAligning);
  s.in.hand_rad = s.in.machine_rad;
  EXPECT_EQ(s.step(), Mode::kEngaged);
}

TEST(Modes, AStaleSensorsFaultBecomesThatOfItsNodeOnceTheNodeSaysThatItStopped) {
  for (const std::uint8_t node : {std::uint8_t{0x22}, std::uint8_t{0x23}}) {
    Story s;
    s.engage();
    s.in.sensor_fault = reason(ReasonCode::kSensorStale, 0x22);
    EXPECT_EQ(s.step(), Mode::kFault);
    s.in.machine_fault = reason(ReasonCode::kNodeFault, node);
    s.in.explains_fault = explains(s.in.machine_fault, s.state.fault, test::test_machine().bus);
    EXPECT_EQ(s.step(), Mode::kFault);
    EXPECT_TRUE(test::is(s.state.fault, node == 0x22 ? ReasonCode::kNodeFault : ReasonCode::kSensorStale));
    EXPECT_TRUE(test::is(s.blocking, ReasonCode::kNodeFault));
  }
  Story s;
  s.engage();
  s.in.machine_fault = reason(ReasonCode::kNodeEmergency, 0x22);
  s.step();
  s.in.machine_fault = reason(ReasonCode::kNodeFault, 0x22);
  s.in.explains_fault = explains(s.in.machine_fault, s.state.fault, test::test_machine().bus);
  s.step();
  EXPECT_TRUE(test::is(s.state.fault, ReasonCode::kNodeEmergency)) << "what came first is the cause";
}

TEST(Modes, EStopBeatsEverythingInEveryModeAndLatches) {
  for (int mode = 0; mode <= static_cast<int>(Mode::kEStop); ++mode) {
    Story s;
    s.state.mode = static_cast<Mode>(mode);
    s.in.e_stop_open = true;
    s.in.machine_fault = reason(ReasonCode::kNodeSilent, 0x10);
    EXPECT_EQ(s.step(), Mode::kEStop);
    EXPECT_TRUE(test::is(s.state.fault, ReasonCode::kEmergencyStop));
    s.in = Story().in;
    s.in.enable = true;
    EXPECT_EQ(s.steps(1000), Mode::kEStop);
    EXPECT_EQ(s.engage(), Mode::kEngaged);
  }
}

TEST(Modes, EveryMachineSideFaultLatchesFromEveryModeAfterTheSelfTest) {
  const Mode modes[] = {Mode::kReady, Mode::kAligning, Mode::kEngaged, Mode::kHold};
  for (const Mode mode : modes) {
    for (int cause = 0; cause < 4; ++cause) {
      Story s;
      s.state = {mode, {}, true};
      ReasonCode expected = ReasonCode::kOperatorStop;
      if (cause == 0) s.in.machine_fault = reason(expected = ReasonCode::kNodeEmergency, 0x12);
      if (cause == 1) s.in.sensor_fault = reason(expected = ReasonCode::kSensorImplausible, 0x30);
      if (cause == 2) s.in.stop = true;
      if (cause == 3) {
        s.in.nodes_operational = false;
        expected = ReasonCode::kNodeSetup;
      }
      EXPECT_EQ(s.step(), Mode::kFault) << name(expected);
      EXPECT_TRUE(test::is(s.state.fault, expected));
    }
  }
}

TEST(Modes, LosingLinkDeviceOrHandIsAFaultOnlyWhileTheMachineIsLed) {
  for (int cause = 0; cause < 3; ++cause) {
    const auto break_it = [cause](Story& s) {
      if (cause == 0) s.in.link_lost = reason(ReasonCode::kLinkLost);
      if (cause == 1) s.in.device = reason(ReasonCode::kDeviceLost);
      if (cause == 2) s.in.presence = false;
    };
    const ReasonCode codes[] = {ReasonCode::kLinkLost, ReasonCode::kDeviceLost, ReasonCode::kPresenceLost};
    for (const Mode mode : {Mode::kEngaged, Mode::kHold}) {
      Story s;
      s.state.mode = mode;
      s.in.enable = true;
      break_it(s);
      EXPECT_EQ(s.step(), Mode::kFault);
      EXPECT_TRUE(test::is(s.state.fault, codes[cause]));
    }
    for (const Mode mode : {Mode::kReady, Mode::kAligning}) {
      Story s;
      s.state = {mode, {}, true};
      s.in.enable = true;
      break_it(s);
      EXPECT_EQ(s.step(), Mode::kReady);
      EXPECT_FALSE(s.state.fault);
      EXPECT_TRUE(s.blocking);
    }
  }
}

TEST(Modes, PilotPressureIsNeededToEngageAndLosingItIsAFault) {
  Story s;
  s.in.pilot_on = false;
  EXPECT_EQ(s.engage(), Mode::kAligning);
  EXPECT_TRUE(test::is(s.blocking, ReasonCode::kPilotAwaited));
  s.in.pilot_on = true;
  EXPECT_EQ(s.step(), Mode::kEngaged);
  s.in.pilot_on = false;
  EXPECT_EQ(s.step(), Mode::kFault);
  EXPECT_TRUE(test::is(s.state.fault, ReasonCode::kPilotOff));
  s.in.enable = false;  // the output is off in a fault, so the pilot stays off: no obstacle to leaving it
  s.step();
  s.in.enable = true;
  EXPECT_EQ(s.step(), Mode::kAligning);
}

TEST(Modes, LettingGoOfDeviceAndEnableTogetherIsNoFault) {
  Story s;
  ASSERT_EQ(s.engage(), Mode::kEngaged);
  s.in.enable = s.in.presence = false;
  EXPECT_EQ(s.step(), Mode::kReady);
}

// Of every mode and any inputs: reasons without a figure have none; a release of enable counts only where nothing else
// stands in the way of pressing it, and a press only after such a release, with nothing missing.
TEST(Modes, EveryDecisionSaysWhatItMeansAndNoMore) {
  const std::set<ReasonCode> without_figure{
      ReasonCode::kStartingUp,       ReasonCode::kNodeSetup,    ReasonCode::kOperatorStop,  ReasonCode::kNoPresence,
      ReasonCode::kPilotAwaited,     ReasonCode::kClutchHeld,   ReasonCode::kEnableHeld,    ReasonCode::kPilotOff,
      ReasonCode::kEnableNotPressed, ReasonCode::kPresenceLost, ReasonCode::kEmergencyStop, ReasonCode::kCommandInvalid,
      ReasonCode::kReleaseToRecover,
  };
  std::set<ReasonCode> seen;
  const auto look = [&](const Reason& why) {
    if (!without_figure.contains(why.code)) return;
    seen.insert(why.code);
    EXPECT_EQ(why.subject, 0) << text(why);
    EXPECT_EQ(why.value, 0) << text(why);
    EXPECT_EQ(why.limit, 0) << text(why);
  };
  std::mt19937 rng(11);
  const auto flip = [&rng](double p) { return std::uniform_real_distribution<>(0, 1)(rng) < p; };
  const auto latches = [](Mode mode) { return mode == Mode::kFault || mode == Mode::kEStop; };
  int pressed = 0;
  for (int i = 0; i < 50000; ++i) {
    Story s;
    s.state.mode = static_cast<Mode>(i % (static_cast<int>(Mode::kEStop) + 2));  // the last is none
    if (latches(s.state.mode)) s.state.fault = reason(ReasonCode::kNodeSilent, 0x10);
    s.state.enable_released = flip(0.5);
    ModeInputs& in = s.in;
    in.enable = flip(0.5);
    in.presence = flip(0.8);
    in.clutch = flip(0.2);
    in.stop = flip(0.1);
    in.e_stop_open = flip(0.05);
    in.nodes_operational = flip(0.9);
    in.pilot_on = flip(0.8);
    if (flip(0.1)) in.link_lost = reason(ReasonCode::kLinkLost);
    if (flip(0.1)) in.sensor_fault = reason(ReasonCode::kSensorStale, 0x30);
    if (flip(0.1)) in.machine_fault = reason(ReasonCode::kNodeSilent, 0x10);
    if (flip(0.1)) in.device = reason(ReasonCode::kDeviceLost);
    if (flip(0.1)) in.late = reason(ReasonCode::kRoundTripTooLong);
    if (flip(0.1)) in.hold = reason(ReasonCode::kBuriedObject);
    if (flip(0.1)) in.hand_rad[kArm] += 0.2;
    const Mode before = s.state.mode;
    const bool may_press = s.state.enable_released;
    const Mode after = s.step();
    look(s.blocking);
    look(s.state.fault);
    const bool operator_there = in.presence && !in.link_lost && !in.late && !in.device;
    bool released = false;
    if (after == Mode::kReady) released = !in.enable && operator_there;
    if (latches(before) && latches(after) && !in.e_stop_open) {
      released = !in.enable && operator_there && !in.hold && in.nodes_operational && !in.machine_fault && !in.stop &&
                 !in.sensor_fault;
    }
    ASSERT_EQ(s.state.enable_released, released) << static_cast<int>(before) << " to " << static_cast<int>(after);
    ASSERT_EQ(static_cast<bool>(s.state.fault), latches(after));
    if (after != Mode::kAligning || before == Mode::kAligning) continue;
    ++pressed;
    ASSERT_TRUE(may_press && in.enable && operator_there) << static_cast<int>(before);
    ASSERT_TRUE(before == Mode::kReady || (latches(before) && !in.hold)) << static_cast<int>(before);
    ASSERT_TRUE(in.nodes_operational && !in.machine_fault && !in.sensor_fault && !in.stop && !in.e_stop_open);
  }
  EXPECT_EQ(seen, without_figure);
  EXPECT_GT(pressed, 1000) << "or this has tested nothing";
}

// Whatever the inputs do, engaged is only ever entered aligned, enabled, present and healthy, and something blocks
// in every other mode.
TEST(Modes, RandomInputsNeverEngageAgainstARule) {
  std::mt19937 rng(7);
  const auto flip = [&rng](double p) { return std::uniform_real_distribution<>(0, 1)(rng) < p; };
  int engaged = 0;
  Story s;
  for (int i = 0; i < 200000; ++i) {
    if (flip(0.02)) s.in.enable = flip(0.7);
    if (flip(0.02)) s.in.presence = flip(0.9);
    if (flip(0.02)) s.in.clutch = flip(0.2);
    s.in.stop = flip(0.001);
    s.in.e_stop_open = flip(0.001);
    s.in.nodes_operational = !flip(0.001);
    s.in.link_lost = flip(0.002) ? reason(ReasonCode::kLinkLost) : Reason{};
    s.in.sensor_fault = flip(0.002) ? reason(ReasonCode::kSensorStale) : Reason{};
    s.in.machine_fault = flip(0.001) ? reason(ReasonCode::kNodeSilent) : Reason{};
    if (flip(0.05)) s.in.hand_rad[kArm] = s.in.machine_rad[kArm] + (flip(0.5) ? 0.2 : 0.01);
    const Mode before = s.state.mode;
    const Mode after = s.step();
    EXPECT_EQ(static_cast<bool>(s.blocking), after != Mode::kEngaged);
    if (s.blocking.code == ReasonCode::kHandNotAligned) {
      EXPECT_GT(s.blocking.value, s.blocking.limit);
    }
    EXPECT_EQ(static_cast<bool>(s.state.fault), after == Mode::kFault || after == Mode::kEStop);
    if (after != Mode::kEngaged) continue;
    ++engaged;
    EXPECT_TRUE(before == Mode::kAligning || before == Mode::kEngaged || before == Mode::kHold);
    EXPECT_TRUE(s.in.enable && s.in.presence && !s.in.clutch && !s.in.stop && !s.in.e_stop_open &&
                s.in.nodes_operational && !s.in.link_lost && !s.in.sensor_fault && !s.in.machine_fault);
    if (before != Mode::kEngaged) {
      EXPECT_LE(std::abs(s.in.hand_rad[kArm] - s.in.machine_rad[kArm]), 5 * kDeg);
    }
  }
  EXPECT_GT(engaged, 1000);
}

}  // namespace
}  // namespace knuckle::slave
