// The whole operator's side against a simulated hand and a scripted machine.
#include "master/master_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/master/master_rig.h"
#include "tests/support/no_alloc.h"

namespace knuckle::master {
namespace {

using test::kMidPosture;
using test::MasterRig;
using test::push_back;

/// Largest change in one millisecond of what the motors truly give at the tip, while `story` runs.
template <typename Story>
double worst_slew(MasterRig& rig, Story&& story) {
  double worst = 0;
  PlanarVector last = rig.hand.truth().felt_N;
  for (int i = 0; story(i); ++i) {
    rig.tick();
    worst = std::max(worst, (rig.hand.truth().felt_N - last).norm());
    last = rig.hand.truth().felt_N;
  }
  return worst;
}

TEST(MasterLoop, SendsTheHandsJointsAndTheirSpeedFiveHundredTimesASecond) {
  MasterRig rig;
  rig.run(0.5);
  const std::uint32_t first = rig.heard.stamp.sequence;
  rig.run(1);
  EXPECT_EQ(rig.heard.stamp.sequence - first, 500u);
  EXPECT_TRUE(rig.heard.device_ok && rig.heard.presence);
  EXPECT_NEAR((rig.heard.position_rad - rig.hand.truth().joint_rad).norm(), 0, 1e-3);
  EXPECT_LE(rig.heard.stamp.sent_at - rig.heard.device_report_at, 2ms);
  rig.intent.rate_radps = JointVector(0.2, -0.3, 0.4);
  for (int i = 0; i < 1000; ++i) {
    rig.intent.joint_rad += 1e-3 * rig.intent.rate_radps;
    rig.tick();
  }
  EXPECT_NEAR((rig.heard.velocity_radps - rig.intent.rate_radps).norm(), 0, 0.03);
}

TEST(MasterLoop, MeasuresTheRoundTripFromItsOwnEchoedTime) {
  for (const Duration one_way : {1ms, 50ms, 200ms}) {
    MasterRig rig(ControlLaw::kEchoSpring, one_way);
    rig.run(3);
    EXPECT_NEAR(rig.loop.round_trip_s(), 2 * to_seconds(one_way), 3e-3);
  }
}

TEST(MasterLoop, LetsTheEchoOfASilentMachineGrowOld) {
  MasterRig rig;
  rig.engage();
  EXPECT_LE(rig.now - rig.heard.stamp.echoed, 10ms);
  const Time last = rig.machine.stamp.sent_at - 2h;
  rig.machine_silent = true;
  rig.run(2);
  EXPECT_LE(rig.heard.stamp.echoed, last + kMostHeld);
}

TEST(MasterLoop, DragsLessThanTwoTenthsOfANewtonInFreeMotion) {
  MasterRig rig;
  rig.machine.covariance_N2 = {2500, 0, 2500};
  rig.react = [](MasterRig& r) {  // no-load error of the estimate: 150 N rms, slowly turning
    const double t = to_seconds(r.now);
    r.machine.tip_force_N = PlanarVector(200 * std::sin(3 * t), 150 * std::sin(7 * t));
  };
  rig.engage();
  double law = 0, felt = 0;
  for (int i = 0; i < 5000; ++i) {
    const double t = i * 1e-3;
    rig.intent.joint_rad = kMidPosture + JointVector(0.2, -0.3, 0.4) * std::sin(2 * t);
    rig.intent.rate_radps = JointVector(0.4, -0.6, 0.8) * std::cos(2 * t);
    rig.tick();
    law = std::max(law, rig.loop.law_force_N().norm());
    felt = std::max(felt, rig.hand.truth().felt_N.norm());
  }
  EXPECT_EQ(law, 0);
  EXPECT_LT(felt, 0.02);
}

TEST(MasterLoop, TellsTheMachineTheForceOnTheHandUnderEachLaw) {
  for (const char* name : kControlLawNames) {
    const ControlLaw law = *control_law_named(name);
    MasterRig rig(law);
    rig.engage();
    push_back(rig);
    double apart_N = 0, most_N = 0;
    for (int i = 0; i < 3000; ++i) {
      const PlanarVector before_N = rig.loop.law_force_N();
      rig.tick();
      if (rig.heard_at != rig.now) continue;
      const PlanarVector rendered_N = rig.loop.force_scale() * rig.heard.rendered_N;
      most_N = std::max(most_N, rendered_N.norm());
      apart_N = std::max(apart_N, (rendered_N - before_N).norm());  // the link takes a millisecond
    }
    if (law == ControlLaw::kCues) {
      EXPECT_EQ(most_N, 0) << "a vibration is not pressed against";
    } else {
      EXPECT_LT(apart_N, 1e-9) << name;
    }
  }
}

TEST(MasterLoop, TellsTheMachineWhatHotMotorsLeaveOfTheForce) {
  MasterRig rig;
  rig.engage();
  rig.intent.joint_rad = JointVector(0.2, -0.6, -0.3);  // stretched: the force takes the most of the motors
  rig.run(2);
  push_back(rig, 7000);
  rig.run(5);
  EXPECT_EQ(rig.loop.warning().code, ReasonCode::kNone);
  rig.run(60);
  const double law_N = rig.loop.law_force_N().norm(), sent_N = rig.loop.sent_force_N().norm();
  ASSERT_LT(sent_N, 0.9 * law_N) << "not hot";
  EXPECT_NEAR(rig.loop.force_scale() * rig.heard.rendered_N.norm(), sent_N, 0.05 * sent_N);
  EXPECT_EQ(rig.loop.warning().code, ReasonCode::kMotorHeat);
}

TEST(MasterLoop, JudgesContactByTheUncertaintyAlongTheForceItself) {
  for (const bool along : {true, false}) {
    MasterRig rig;
    rig.engage();
    rig.follow = false;
    rig.machine.tip_force_N = PlanarVector(0, 500);
    rig.machine.covariance_N2 = {along ? 100.0 : 4e4, 0, along ? 4e4 : 100.0};  // 200 N: R_on = 0.8 N
    rig.run(0.2);
    EXPECT_EQ(rig.loop.law_force_N().norm() > 0, !along);
  }
}

TEST(MasterLoop, GivesNoForceUnlessEngaged) {
  for (const Mode mode :
       {Mode::kOff, Mode::kSelfTest, Mode::kReady, Mode::kAligning, Mode::kHold, Mode::kFault, Mode::kEStop}) {
    for (const ControlLaw law : {ControlLaw::kEchoSpring, ControlLaw::kDirect}) {
      MasterRig rig(law);
      rig.run(0.3);
      rig.machine.mode = mode;
      push_back(rig);
      rig.run(1);
      EXPECT_LT(rig.hand.truth().felt_N.norm(), 0.01) << int(mode);
    }
  }
}

TEST(MasterLoop, GivesNoForceToAHandThatDoesNotLead) {
  MasterRig rig;
  rig.engage();
  push_back(rig);
  rig.run(1);
  ASSERT_GT(rig.hand.truth().felt_N.norm(), 0.5);
  rig.loop.set_nobody(true);
  rig.run(1);
  EXPECT_LT(rig.hand.truth().felt_N.norm(), 0.05) << "whatever mode another hand has led the machine into";
}

/// The clutch shifts the hand first, so that its room reaches beyond the machine's.
void push_against_the_booms_end(MasterRig& rig) {
  rig.engage();
  rig.machine.mode = Mode::kHold;
  rig.intent.clutch = true;
  rig.intent.joint_rad = kMidPosture - JointVector(0.4, 0, 0);
  rig.run(0.5);
  rig.intent.clutch = false;
  rig.run(0.01);
  rig.machine.mode = Mode::kEngaged;
  rig.intent.joint_rad = kMidPosture + JointVector(0.6, 0, 0);
  rig.run(1);
}

TEST(MasterLoop, BelievesAModeForHalfASecondOnly) {
  MasterRig rig;
  push_against_the_booms_end(rig);
  ASSERT_LT(rig.loop.joint_torque_Nm()[0], -0.3) << "at the wall of the boom's end";
  EXPECT_FALSE(rig.loop.set_scales(5, 2e-3));
  rig.machine_silent = true;
  rig.run(0.7);
  EXPECT_EQ(rig.loop.joint_torque_Nm().norm(), 0);
  EXPECT_TRUE(rig.loop.set_scales(5, 2e-3));
}

TEST(MasterLoop, ForgetsWhatAMachineToldOfItselfWithTheLink) {
  MasterRig rig;
  rig.run(0.3);
  ReadingsMessage message;
  message.stamp = rig.session.stamp(1, rig.now);
  MachineReadings readings;
  readings.battery_V = 27.6;
  message.set(readings);
  rig.network.b().send(encode(message).view());
  rig.run(0.05);
  ASSERT_TRUE(rig.loop.machine_readings());
  EXPECT_NEAR(rig.loop.machine_readings()->battery_V, 27.6, 0.01);
  rig.machine_silent = true;
  rig.run(0.7);
  EXPECT_FALSE(rig.loop.machine_readings());
}

// Every way a felt force can end or start must stay below 0.5 N/ms at the motors.
struct Transition {
  const char* name;
  void (*happen)(MasterRig&);
};
class MasterTransitions : public testing::TestWithParam<Transition> {};
TEST_P(MasterTransitions, ChangeTheForceSlowerThanHalfANewtonPerMillisecond) {
  for (const ControlLaw law : {ControlLaw::kEchoSpring, ControlLaw::kDirect}) {
    MasterRig rig(law);
    rig.engage();
    double worst = worst_slew(rig, [&](int i) {
      if (i == 0) push_back(rig, 7000);
      return i < 8000;
    });
    EXPECT_GT(rig.hand.truth().felt_N.norm(), 3) << "the story starts with a force";
    worst = std::max(worst, worst_slew(rig, [&](int i) {
                       if (i == 50) GetParam().happen(rig);
                       return i < 1000;
                     }));
    EXPECT_LT(worst, 0.5);
    EXPECT_LT(rig.hand.truth().felt_N.norm(), 0.5);
  }
}
INSTANTIATE_TEST_SUITE_P(
    Stories, MasterTransitions,
    testing::Values(
        Transition{"hold", [](MasterRig& r) { r.machine.mode = Mode::kHold; }},
        Transition{"fault", [](MasterRig& r) { r.machine.mode = Mode::kFault; }},
        Transition{"silence", [](MasterRig& r) { r.machine_silent = true; }},
        Transition{"let_go", [](MasterRig& r) { r.loop.let_go(); }},
        Transition{"unplugged", [](MasterRig& r) { r.cable.unplug(); }},
        Transition{"silent_device", [](MasterRig& r) { r.hand.firmware().inject(sim::FirmwareFault::kSilent); }},
        Transition{"wild_counts", [](MasterRig& r) { r.hand.firmware().inject(sim::FirmwareFault::kWildCounts); }},
        Transition{"hand_off", [](MasterRig& r) { r.intent.presence = false; }}),
    [](const auto& story) { return std::string(story.param.name); });

TEST(MasterLoop, TellsTheMachineWithinThreeMillisecondsThatTheDeviceIsGone) {
  MasterRig rig;
  rig.engage();
  rig.cable.unplug();
  rig.run(0.004);  // one of them on the link
  EXPECT_FALSE(rig.heard.device_ok);
  EXPECT_EQ(rig.heard.device_reason.code, ReasonCode::kDeviceLost);
  EXPECT_FALSE(rig.heard.presence || rig.heard.enable);
}

TEST(MasterLoop, ClutchMovesTheHandAndNotTheSetPoint) {
  MasterRig rig;
  rig.engage();
  rig.intent.clutch = true;
  rig.run(0.02);
  rig.machine.mode = Mode::kHold;
  const JointVector before = rig.heard.position_rad;
  rig.intent.joint_rad += JointVector(0.2, 0.1, -0.3);
  rig.run(1);
  EXPECT_NEAR((rig.heard.position_rad - before).norm(), 0, 1e-9);
  EXPECT_NEAR(rig.heard.velocity_radps.norm(), 0, 1e-6);
  rig.intent.clutch = false;
  rig.run(0.02);
  rig.machine.mode = Mode::kEngaged;
  rig.run(0.5);
  EXPECT_NEAR((rig.heard.position_rad - before).norm(), 0, 2e-3);  // no jump on release
  rig.intent.joint_rad += JointVector(0.1, 0, 0);
  rig.run(1);
  EXPECT_NEAR(rig.heard.position_rad[0] - before[0], 0.1, 2e-3);  // and the hand leads again
}

TEST(MasterLoop, ClutchBeforeEngagingAlignsTheSetPointWithTheMachine) {
  MasterRig rig;
  rig.follow = false;
  rig.machine.position_rad = kMidPosture + JointVector(0.4, 0.5, 0.6);
  rig.run(0.3);
  EXPECT_GT((rig.heard.position_rad - rig.machine.position_rad).norm(), 0.5);
  rig.intent.clutch = true;
  rig.run(0.1);
  rig.intent.clutch = false;
  rig.run(0.1);
  EXPECT_NEAR((rig.heard.position_rad - rig.machine.position_rad).norm(), 0, 1e-3);
}

TEST(MasterLoop, ForgetsItsAlignmentWhenTheDeviceComesBack) {
  MasterRig rig;
  rig.follow = false;
  rig.machine.position_rad = kMidPosture + JointVector(0.4, 0.5, 0.6);
  rig.intent.clutch = true;
  rig.run(0.4);
  rig.intent.clutch = false;
  rig.cable.unplug();
  rig.run(0.1);
  rig.cable.plug();
  rig.run(0.5);
  EXPECT_TRUE(rig.heard.device_ok);
  EXPECT_NEAR((rig.heard.position_rad - rig.hand.truth().joint_rad).norm(), 0, 1e-3);
}

TEST(MasterLoop, KeepsTheSetPointInTheMachinesRangeAndPushesTheHandBack) {
  MasterRig rig;
  push_against_the_booms_end(rig);
  EXPECT_NEAR(rig.heard.position_rad[0], 1.092, 1e-9);
  EXPECT_LE(rig.heard.velocity_radps[0], 0);
  EXPECT_LT(rig.loop.joint_torque_Nm()[0], -0.3);
  EXPECT_EQ(rig.loop.law_force_N().norm(), 0);
}

TEST(MasterLoop, ChangesScalesOnlyWhileTheMachineIsNotLedNorAboutToBe) {
  MasterRig rig;
  rig.engage();
  for (const Mode mode : {Mode::kAligning, Mode::kEngaged, Mode::kHold}) {
    rig.machine.mode = mode;
    rig.run(0.1);
    EXPECT_FALSE(rig.loop.set_scales(5, 2e-3)) << name(mode);
  }
  rig.machine.mode = Mode::kReady;
  rig.run(0.1);
  EXPECT_FALSE(rig.loop.set_scales(-5, 2e-3));
  EXPECT_FALSE(rig.loop.set_scales(5, std::numeric_limits<double>::quiet_NaN()));
  EXPECT_FALSE(rig.loop.set_scales(std::numeric_limits<double>::infinity(), 1e-4));
  EXPECT_FALSE(rig.loop.set_scales(20, 1.01e-3)) << "more than twice as stiff as the file's";
  rig.intent.enable = true;
  rig.run(0.1);
  EXPECT_FALSE(rig.loop.set_scales(5, 2e-3)) << "pressed, and the machine's answer is still under way";
  rig.intent.enable = false;
  rig.run(0.1);
  const JointVector before = rig.heard.position_rad;
  EXPECT_TRUE(rig.loop.set_scales(5, 2e-3));
  rig.run(0.1);
  EXPECT_NEAR((rig.heard.position_rad - before).norm(), 0, 1e-3);
  rig.intent.joint_rad += JointVector(0.2, 0, 0);
  rig.run(1);
  EXPECT_NEAR(rig.heard.position_rad[0] - before[0], 0.1, 1e-3);
}

TEST(MasterLoop, ShowsItsTapEveryMessageCopiesAndOvertakenOnesIncluded) {
  MasterRig rig;
  rig.run(0.3);
  std::vector<std::uint32_t> seen;
  rig.loop.set_tap({[](void* numbers, const SlaveMessage& message) {
                      static_cast<std::vector<std::uint32_t>*>(numbers)->push_back(message.stamp.sequence);
                    },
                    &seen});
  const std::uint32_t newest = rig.machine.stamp.sequence;
  Datagram garbage;
  garbage.size = 3;
  rig.network.b().send(garbage.view());
  for (const std::uint32_t sequence : {newest + 2, newest + 1, newest + 2}) {
    rig.machine.stamp.sequence = sequence;
    rig.network.b().send(encode(rig.machine).view());
  }
  rig.run(0.002);
  EXPECT_EQ(seen, (std::vector<std::uint32_t>{newest, newest + 2, newest + 1, newest + 2}));
  EXPECT_EQ(rig.loop.machine()->stamp.sequence, newest + 2);
}

TEST(MasterLoop, LateCopyEndsNoSilence) {
  MasterRig rig;
  rig.engage();
  const SlaveMessage before = rig.machine;
  rig.run(0.1);
  rig.machine_silent = true;
  rig.run(1.5);
  ASSERT_EQ(rig.loop.machine()->stamp.sequence, rig.machine.stamp.sequence);
  for (SlaveMessage copy : {before, rig.machine}) {
    copy.mode = Mode::kReady;
    rig.network.b().send(encode(copy).view());
    rig.run(0.003);
    EXPECT_EQ(rig.loop.machine()->mode, Mode::kEngaged);
    EXPECT_GT(rig.loop.silence_s(), 1.5);
  }
}

TEST(MasterLoop, HearsAMachinesSideThatStartedAnewAfterASecondOfSilence) {
  MasterRig rig;
  rig.engage();
  rig.machine_silent = true;
  rig.run(0.5);
  rig.session = LinkSession({12, 0h}, 200ms);
  rig.machine.stamp.sequence = 0;
  rig.machine.mode = Mode::kReady;
  rig.machine_silent = false;
  rig.run(0.4);
  EXPECT_EQ(rig.loop.machine()->mode, Mode::kEngaged);
  rig.run(0.2);
  EXPECT_EQ(rig.loop.machine()->mode, Mode::kReady);
  EXPECT_LT(rig.loop.silence_s(), 0.01);
}

/// A network that brings more than anybody can read.
struct LinkFlood final : Link {
  bool send(std::span<const std::uint8_t>) noexcept override { return true; }
  bool receive(Datagram& datagram) noexcept override {
    datagram = brought;
    return ++reads < 1000000;
  }
  Datagram brought;
  int reads = 0;
};

TEST(MasterLoop, EndsItsStepHoweverMuchTheNetworkBrings) {
  for (const Datagram& brought : {encode(SlaveMessage{}), encode(MachineStatus{}), Datagram{}}) {
    HidPair cable;
    LinkFlood flood;
    flood.brought = brought;
    MasterLoop loop(test::desk_device(), test::desk_machine(), cable.host(), flood, {5, 1h}, ControlLaw::kEchoSpring);
    const test::NoAllocScope scope;
    loop.step(Time(1ms));
    const auto allocations = scope.allocations();
    EXPECT_LE(flood.reads, 64);
    EXPECT_EQ(allocations, 0u);
  }
}

TEST(MasterLoop, FeelsAgainAfterAMachineThatSpokeNonsense) {
  MasterRig rig;
  rig.engage();
  rig.machine.velocity_radps[0] = 1e308;
  rig.run(0.02);
  rig.machine.velocity_radps.setZero();
  push_back(rig);
  rig.run(20);
  EXPECT_NEAR((rig.hand.truth().felt_N - PlanarVector(0, 2)).norm(), 0, 0.3);
  EXPECT_NEAR((rig.loop.sent_force_N() - rig.loop.law_force_N()).norm(), 0, 0.02);
}

TEST(MasterLoop, AllocatesNothingWhileItSteps) {
  MasterRig rig;
  rig.engage();
  push_back(rig);
  rig.run(0.5);
  test::NoAllocScope scope;
  for (int i = 0; i < 500; ++i) {
    if (i == 100) rig.cable.unplug();
    if (i == 200) rig.cable.plug();
    rig.tick();
  }
  EXPECT_EQ(scope.allocations(), 0u);
}

}  // namespace
}  // namespace knuckle::master
