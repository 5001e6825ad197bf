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

/// The machine presses against something: its tip stays a few millimetres (hand) above the hand's, its force points up.
void push_back(MasterRig& rig, double force_N = 2000) {
  rig.follow = false;
  rig.machine.tip_force_N = PlanarVector(0, force_N);
  rig.machine.covariance_N2 = {400, 0, 400};
  rig.react = [](MasterRig& r) { r.machine.position_rad = r.heard.position_rad + JointVector(0.012, 0, 0); };
}

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

TEST(MasterLoop, SendsTheHandsJointsFiveHundredTimesASecond) {
  MasterRig rig;
  rig.run(0.5);
  const std::uint32_t first = rig.heard.sequence;
  rig.run(1);
  EXPECT_EQ(rig.heard.sequence - first, 500u);
  EXPECT_TRUE(rig.heard.device_ok && rig.heard.presence);
  EXPECT_NEAR((rig.heard.position_rad - rig.hand.truth().joint_rad).norm(), 0, 1e-3);
  EXPECT_LE(rig.heard.sent_at - rig.heard.device_report_at, 2ms);
}

TEST(MasterLoop, SendsSpeedAheadOfPosition) {
  MasterRig rig;
  rig.run(0.3);
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
  EXPECT_LE(rig.now - rig.heard.echoed_slave_time, 10ms);
  const Time last = rig.machine.sent_at;
  rig.machine_silent = true;
  rig.run(2);
  EXPECT_LE(rig.heard.echoed_slave_time, last + kMostHeld);
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

TEST(MasterLoop, RendersTheReflectedForceAtTheHand) {
  MasterRig rig;
  rig.engage();
  push_back(rig);
  rig.run(20);
  EXPECT_NEAR((rig.hand.truth().felt_N - PlanarVector(0, 2)).norm(), 0, 0.3);
  EXPECT_NEAR((rig.loop.sent_force_N() - rig.loop.law_force_N()).norm(), 0, 0.02);
}

TEST(MasterLoop, JudgesContactByTheUncertaintyAlongTheForceItself) {
  for (const bool along : {true, false}) {
    MasterRig rig;
    rig.engage();
    rig.follow = false;
    rig.machine.tip_force_N = PlanarVector(0, 500);
    rig.machine.covariance_N2 = {along ? 100.0 : 4e4, 0, along ? 4e4 : 100.0};  // 200 N: R_on = 0.8 N
    rig.run(0.2);
    EXPECT_EQ(rig.loop.spring().contact(), !along);
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
  rig.engage();
  rig.machine.mode = Mode::kHold;
  rig.intent.clutch = true;  // shift, so that the hand's room reaches beyond the machine's
  rig.intent.joint_rad = kMidPosture - JointVector(0.4, 0, 0);
  rig.run(0.5);
  rig.intent.clutch = false;
  rig.run(0.01);
  rig.machine.mode = Mode::kEngaged;
  rig.intent.joint_rad = kMidPosture + JointVector(0.6, 0, 0);
  rig.run(1);
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

TEST(MasterLoop, TakesTheNewestMessageAndIgnoresOvertakenOnes) {
  MasterRig rig;
  rig.run(0.3);
  SlaveMessage late = rig.machine;
  late.sequence -= 3;
  late.mode = Mode::kFault;
  rig.network.b().send(encode(late).view());
  rig.run(0.003);
  EXPECT_EQ(rig.loop.machine()->mode, Mode::kReady);
}

TEST(MasterLoop, ShowsItsTapEveryMessageCopiesAndOvertakenOnesIncluded) {
  MasterRig rig;
  rig.run(0.3);
  std::vector<std::uint32_t> seen;
  rig.loop.set_tap({[](void* numbers, const SlaveMessage& message) {
                      static_cast<std::vector<std::uint32_t>*>(numbers)->push_back(message.sequence);
                    },
                    &seen});
  const std::uint32_t newest = rig.machine.sequence;
  Datagram garbage;
  garbage.size = 3;
  rig.network.b().send(garbage.view());
  for (const std::uint32_t sequence : {newest + 2, newest + 1, newest + 2}) {
    rig.machine.sequence = sequence;
    rig.network.b().send(encode(rig.machine).view());
  }
  rig.run(0.002);
  EXPECT_EQ(seen, (std::vector<std::uint32_t>{newest, newest + 2, newest + 1, newest + 2}));
  EXPECT_EQ(rig.loop.machine()->sequence, newest + 2);
}

TEST(MasterLoop, LateCopyEndsNoSilence) {
  MasterRig rig;
  rig.engage();
  const SlaveMessage before = rig.machine;
  rig.run(0.1);
  rig.machine_silent = true;
  rig.run(1.5);
  ASSERT_EQ(rig.loop.machine()->sequence, rig.machine.sequence);
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
  rig.machine.sequence = 0;
  rig.machine.mode = Mode::kReady;
  rig.machine_silent = false;
  rig.run(0.4);
  EXPECT_EQ(rig.loop.machine()->mode, Mode::kEngaged);
  rig.run(0.2);
  EXPECT_EQ(rig.loop.machine()->mode, Mode::kReady);
  EXPECT_LT(rig.loop.silence_s(), 0.01);
}

/// A network that brings more than anybody can read.
struct Flood final : Link {
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
    Flood flood;
    flood.brought = brought;
    MasterLoop loop(test::desk_device(), test::desk_machine(), cable.host(), flood, ControlLaw::kEchoSpring);
    const test::NoAllocScope scope;
    loop.step(Time(1ms));
    const auto allocations = scope.allocations();
    EXPECT_LE(flood.reads, 64);
    EXPECT_EQ(allocations, 0u);
  }
}

/// What of a message is said of somebody who holds the device.
bool anybody(const MasterMessage& message) {
  return message.presence || message.enable || message.clutch;
}

/// A rig with somebody who holds the device and presses all there is.
MasterRig& held(MasterRig& rig) {
  rig.intent.enable = rig.intent.clutch = true;
  return rig;
}

TEST(MasterLoop, SaysThatNobodyHoldsTheDeviceUntilTheMachinesSideNamesThisMachine) {
  MasterRig rig;
  rig.tells_status = false;
  rig.run(0.4);
  held(rig).run(0.4);
  EXPECT_TRUE(rig.loop.device().presence && rig.loop.device().enable && rig.loop.device().clutch);
  EXPECT_TRUE(rig.heard.device_ok);
  EXPECT_FALSE(anybody(rig.heard));
  rig.tells_status = true;
  rig.run(0.1);
  EXPECT_TRUE(rig.heard.presence && rig.heard.enable && rig.heard.clutch);
  rig.status.machine = MachineName("another");
  rig.run(0.1);
  EXPECT_FALSE(anybody(rig.heard)) << "whatever it was before";
}

TEST(MasterLoop, SaysTheSameInEverythingElseToAMachineThatItMustNotLead) {
  MasterRig same, other;
  other.status.machine = MachineName("another");
  for (int i = 0; i < 1500; ++i) {
    for (MasterRig* rig : {&same, &other}) {
      rig->intent.enable = i > 400;
      rig->intent.clutch = i > 600 && i < 900;
      rig->intent.stop = i > 1000 && i < 1100;
      rig->intent.joint_rad = kMidPosture + JointVector(0.1, -0.1, 0.2) * std::sin(0.01 * i);
      if (i == 1200) rig->cable.unplug();
      rig->tick();
    }
    MasterMessage expected = same.heard;
    expected.presence = expected.enable = expected.clutch = false;
    const Datagram a = encode(expected), b = encode(other.heard);
    ASSERT_TRUE(std::ranges::equal(a.view(), b.view())) << i;
  }
}

TEST(MasterLoop, TellsWhyAFarEndCannotBeLedOnceItHasHadASecondToTellItsMachine) {
  MasterRig rig;
  rig.tells_status = false;
  rig.machine_silent = true;
  rig.run(3);
  EXPECT_FALSE(rig.loop.other_machine()) << "nothing is heard at all";
  rig.machine_silent = false;
  while (!rig.loop.machine()) rig.tick();
  rig.run(1);
  EXPECT_FALSE(rig.loop.other_machine()) << "it may still tell";
  rig.tick();
  EXPECT_EQ(rig.loop.other_machine().code, ReasonCode::kMachineNotTold);
  rig.tells_status = true;
  rig.run(0.06);
  EXPECT_FALSE(rig.loop.other_machine());
  rig.status.machine = MachineName("another");
  rig.run(0.06);
  EXPECT_EQ(rig.loop.other_machine().code, ReasonCode::kOtherMachine);
  rig.status.machine = rig.loop.machine_name();
  rig.run(0.06);
  rig.tells_status = false;
  rig.run(5);
  EXPECT_FALSE(rig.loop.other_machine()) << "who has told need not tell for ever";
}

TEST(MasterLoop, AFarEndOfWhichOnlyNonsenseComesHasNotToldItsMachine) {
  MasterRig rig;
  rig.tells_status = false;
  rig.machine_silent = true;
  Datagram garbage;
  garbage.size = 3;
  rig.network.b().send(garbage.view());
  rig.run(1.1);
  EXPECT_EQ(rig.loop.other_machine().code, ReasonCode::kMachineNotTold);
}

TEST(MasterLoop, LeadsUncheckedOnlyAFarEndThatIsMadeOfTheSameDescription) {
  for (const FarEnd far_end : {FarEnd::kIsThisMachine, FarEnd::kTellsItsMachine}) {
    MasterRig rig;
    MasterLoop loop(test::desk_device(), test::desk_machine(), rig.cable.host(), rig.network.a(),
                    ControlLaw::kEchoSpring, far_end);
    for (int i = 0; i < 500; ++i) {
      rig.now += 1ms;
      rig.cable.advance();
      rig.network.advance(rig.now);
      rig.hand.step(rig.now, rig.intent);
      loop.step(rig.now);
      while (rig.network.b().receive(rig.datagram)) rig.heard = *decode_master(rig.datagram.view());
    }
    EXPECT_EQ(rig.heard.presence, far_end == FarEnd::kIsThisMachine);
    EXPECT_FALSE(loop.other_machine());
  }
}

TEST(MasterLoop, KeepsTheNewestStatusBesideTheMessages) {
  MasterRig rig;
  EXPECT_FALSE(rig.loop.machine_status());
  EXPECT_EQ(rig.loop.machine_status_at(), kNever);
  rig.run(0.3);
  Datagram garbage;
  garbage.size = 3;
  rig.network.b().send(garbage.view());
  for (int i = 0; i < 3; ++i) {  // all in one step
    rig.status.steps = ++rig.status.sequence;
    rig.network.b().send(encode(rig.status).view());
    ++rig.machine.sequence;
    rig.network.b().send(encode(rig.machine).view());
  }
  rig.tick();
  EXPECT_EQ(rig.loop.machine_status()->steps, rig.status.steps);
  EXPECT_EQ(rig.loop.machine_status_at(), rig.now) << "its arrival";
  EXPECT_EQ(rig.loop.machine()->sequence, rig.machine.sequence);
}

TEST(MasterLoop, TheNewestStatusWinsUntilTheMachineHasBeenSilent) {
  MasterRig rig;
  rig.tells_status = false;
  const auto told = [&](double after_s, std::uint32_t sequence, std::uint64_t steps) {
    rig.run(after_s - 0.002);
    rig.status.sequence = sequence;
    rig.status.steps = steps;
    rig.network.b().send(encode(rig.status).view());
    rig.run(0.002);
    return rig.loop.machine_status()->steps;
  };
  EXPECT_EQ(told(0.1, 0xFFFFFFFF, 1), 1u);
  EXPECT_EQ(told(0.05, 0, 2), 2u) << "across the wrap";
  const Time newest = rig.loop.machine_status_at();
  EXPECT_EQ(told(0.05, 0xFFFFFFFF, 3), 2u) << "late";
  EXPECT_EQ(told(0.05, 0, 4), 2u) << "twice";
  EXPECT_EQ(rig.loop.machine_status_at(), newest);
  EXPECT_EQ(told(0.9, 0xFFFFFFFF, 5), 5u) << "it has started anew";
}

TEST(MasterLoop, WithNobodyWhoAttendsSaysThatNobodyHoldsTheDeviceWhateverTheDeviceSays) {
  MasterRig rig;
  rig.run(0.3);
  held(rig).run(0.1);
  rig.loop.set_nobody(true);
  rig.run(0.01);
  EXPECT_FALSE(anybody(rig.heard));
  EXPECT_TRUE(rig.heard.device_ok);
  rig.loop.set_nobody(false);
  rig.run(0.01);
  EXPECT_TRUE(rig.heard.presence && rig.heard.enable && rig.heard.clutch);
}

TEST(MasterLoop, ReportsNoTorqueAndCountsNoEnergyOfOneOnceItHasLetGo) {
  MasterRig rig;
  rig.engage();
  push_back(rig, 7000);
  rig.run(8);
  ASSERT_GT(rig.loop.sent_force_N().norm(), 3);
  rig.loop.let_go();
  rig.tick();
  EXPECT_EQ(rig.loop.sent_force_N().norm(), 0);
  const double in_J = rig.loop.energy().in_J(), out_J = rig.loop.energy().out_J();
  rig.intent.joint_rad += JointVector(0.2, 0.1, -0.3);
  rig.run(1);
  EXPECT_EQ(rig.loop.energy().in_J(), in_J);
  EXPECT_EQ(rig.loop.energy().out_J(), out_J);
}

/// Notes what the device is told.
struct Overheard final : HidPort {
  explicit Overheard(HidPort& wire) : port(wire) {}
  bool write(const HidReport& report) noexcept override {
    if (const auto command = decode_command(report)) told = *command;
    return port.write(report);
  }
  bool read(HidReport& report) noexcept override { return port.read(report); }
  [[nodiscard]] bool connected() const noexcept override { return port.connected(); }
  HidPort& port;
  DeviceCommand told;
};

TEST(MasterLoop, LetsGoOfMachineAndDeviceForGood) {
  MasterRig rig;
  held(rig).engage();
  push_back(rig, 7000);
  rig.run(8);
  EXPECT_GT(rig.hand.truth().felt_N.norm(), 3);
  rig.loop.let_go();
  rig.loop.set_nobody(false);
  const std::uint32_t said = rig.heard.sequence;
  for (int i = 0; i < 100; ++i) {
    EXPECT_FALSE(rig.loop.has_let_go()) << i;
    rig.tick();
    if (rig.heard.sequence > said + 1) {
      ASSERT_FALSE(anybody(rig.heard)) << i;
    }
  }
  EXPECT_TRUE(rig.loop.has_let_go());
  EXPECT_TRUE(rig.heard.device_ok) << "it is let go of, not lost";
  rig.run(2);
  EXPECT_EQ(rig.hand.truth().motor_torque_Nm.norm(), 0);
  EXPECT_FALSE(anybody(rig.heard));
}

TEST(MasterLoop, TellsTheDeviceToBeOffFromTheStepThatLetsGoOn) {
  MasterRig rig;
  Overheard port(rig.cable.host());
  MasterLoop loop(test::desk_device(), test::desk_machine(), port, rig.network.a(), ControlLaw::kEchoSpring);
  const auto step = [&] {
    rig.now += 1ms;
    rig.cable.advance();
    rig.hand.step(rig.now, rig.intent);
    loop.step(rig.now);
  };
  for (int i = 0; i < 300; ++i) step();
  EXPECT_EQ(port.told.mode, TorqueMode::kTorque);
  const std::uint16_t number = port.told.sequence;
  loop.let_go();
  for (int i = 1; i < 300; ++i) {
    step();
    ASSERT_EQ(port.told.mode, TorqueMode::kOff) << i;
    ASSERT_EQ(port.told.torque_permille, PerJoint<std::int16_t>{}) << i;
    ASSERT_EQ(port.told.sequence, number + i) << "it is told so in every step";
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

TEST(TorqueLimiter, HoldsMotorsAtRatedCurrentBeforeTheFirmwareTrips) {
  MasterRig rig(ControlLaw::kDirect);
  rig.engage();
  rig.follow = false;
  rig.intent.joint_rad = kMidPosture;
  rig.react = [](MasterRig& r) { r.machine.tip_force_N = PlanarVector(0, 8000); };
  double hottest = 0;
  for (int i = 0; i < 60000; ++i) {
    rig.tick();
    for (const double heat : rig.hand.truth().motor_heat) hottest = std::max(hottest, heat);
  }
  EXPECT_GT(hottest, 0.85);
  EXPECT_LT(hottest, 1.02);
  EXPECT_FALSE(rig.hand.firmware().latched());
  EXPECT_GT(rig.hand.truth().felt_N.norm(), 2);
}

TEST(TorqueLimiter, TakesANonFiniteTorqueForNone) {
  TorqueLimiter limiter(test::desk_device());
  const auto posture = DeviceKinematics(test::desk_device().link_m).posture(kMidPosture);
  const JointVector wanted(std::numeric_limits<double>::quiet_NaN(), 1, 1);
  EXPECT_EQ(limiter.step(wanted, posture.jacobian, 1e-3).norm(), 0);
}

TEST(EnergyPort, LowersTheForceWhileMoreThanHalfAJouleNetComesBackInTwoSeconds) {
  EnergyPort port;
  for (int i = 0; i < 1000; ++i) port.step(-2, 1e-3);  // the hand puts in 2 J,
  for (int i = 0; i < 900; ++i) port.step(2, 1e-3);    // and 1.8 J come back within the window
  EXPECT_EQ(port.gain(), 1);
  EXPECT_NEAR(port.in_J(), 2, 1e-9);
  EXPECT_NEAR(port.out_J(), 1.8, 1e-9);
  double last = 1;
  for (int i = 0; i < 3000; ++i) {
    port.step(1, 1e-3);
    EXPECT_LT(last - port.gain(), 0.003);
    last = port.gain();
  }
  EXPECT_EQ(port.gain(), 0);
  for (int i = 0; i < 8000; ++i) port.step(0, 1e-3);
  EXPECT_EQ(port.gain(), 1);
}

TEST(DeviceKinematics, JacobianIsTheDerivativeOfTheTip) {
  const DeviceKinematics kinematics(test::desk_device().link_m);
  const DevicePosture posture = kinematics.posture(kMidPosture);
  for (Eigen::Index i = 0; i < kJoints; ++i) {
    JointVector moved = kMidPosture;
    moved[i] += 1e-6;
    const PlanarVector slope = (kinematics.posture(moved).tip_m - posture.tip_m) / 1e-6;
    EXPECT_NEAR((slope - posture.jacobian.col(i)).norm(), 0, 1e-6);
  }
  EXPECT_NEAR((kinematics.posture(JointVector::Zero()).tip_m - PlanarVector(0.32, 0)).norm(), 0, 1e-12);
  const PlanarVector force(3, -2);
  EXPECT_NEAR((tip_force_of(posture.jacobian, posture.jacobian.transpose() * force) - force).norm(), 0, 5e-3);
}

}  // namespace
}  // namespace knuckle::master
