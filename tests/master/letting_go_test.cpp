// Which machine the operator's side leads, and that it lets go of machine and device for good.
#include <gtest/gtest.h>

#include "master/master_loop.h"
#include "tests/master/master_rig.h"
#include "tests/support/overheard.h"

namespace knuckle::master {
namespace {

using test::kMidPosture;
using test::MasterRig;
using test::push_back;

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
    MasterLoop loop(test::desk_device(), test::desk_machine(), rig.cable.host(), rig.network.a(), {5, 1h},
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
    rig.status.steps = rig.status.stamp.sequence + 1;
    rig.tell_status();
    rig.tell();
  }
  rig.tick();
  EXPECT_EQ(rig.loop.machine_status()->steps, rig.status.steps);
  EXPECT_EQ(rig.loop.machine_status_at(), rig.now) << "its arrival";
  EXPECT_EQ(rig.loop.machine()->stamp.sequence, rig.machine.stamp.sequence);
}

TEST(MasterLoop, TheNewestStatusWinsUntilTheMachineHasRestarted) {
  MasterRig rig;
  rig.tells_status = false;
  const auto told = [&](double after_s, std::uint32_t sequence, std::uint64_t steps) {
    rig.run(after_s - 0.002);
    rig.status.stamp.sequence = sequence - 1;
    rig.status.steps = steps;
    rig.tell_status();
    rig.run(0.002);
    return rig.loop.machine_status()->steps;
  };
  EXPECT_EQ(told(0.1, 0xFFFFFFFF, 1), 1u);
  EXPECT_EQ(told(0.05, 0, 2), 2u) << "across the wrap";
  const Time newest = rig.loop.machine_status_at();
  EXPECT_EQ(told(0.05, 0xFFFFFFFF, 3), 2u) << "late";
  EXPECT_EQ(told(0.05, 0, 4), 2u) << "twice";
  EXPECT_EQ(rig.loop.machine_status_at(), newest);
  EXPECT_EQ(told(1.9, 0xFFFFFFFF, 5), 2u);
  rig.machine_silent = true;
  rig.run(1);
  rig.machine_silent = false;
  rig.session = LinkSession({12, 0h}, 200ms);
  rig.run(0.01);
  EXPECT_FALSE(rig.loop.machine_status()) << "it may be another machine";
  EXPECT_EQ(told(0.1, 0xFFFFFFFF, 6), 6u);
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

TEST(MasterLoop, LetsGoOfMachineAndDeviceForGood) {
  MasterRig rig;
  held(rig).engage();
  push_back(rig, 7000);
  rig.run(8);
  EXPECT_GT(rig.hand.truth().felt_N.norm(), 3);
  ASSERT_GT(rig.loop.sent_force_N().norm(), 3);
  rig.loop.let_go();
  rig.loop.set_nobody(false);
  const std::uint32_t said = rig.heard.stamp.sequence;
  for (int i = 0; i < 100; ++i) {
    EXPECT_FALSE(rig.loop.has_let_go()) << i;
    rig.tick();
    if (rig.heard.stamp.sequence > said + 1) {
      ASSERT_FALSE(anybody(rig.heard)) << i;
    }
  }
  EXPECT_TRUE(rig.loop.has_let_go());
  EXPECT_TRUE(rig.heard.device_ok) << "it is let go of, not lost";
  EXPECT_EQ(rig.heard.rendered_N.norm(), 0);
  EXPECT_EQ(rig.loop.sent_force_N().norm(), 0);
  const double in_J = rig.loop.energy().in_J(), out_J = rig.loop.energy().out_J();
  rig.intent.joint_rad += JointVector(0.2, 0.1, -0.3);
  rig.run(2);
  EXPECT_EQ(rig.loop.energy().in_J(), in_J);
  EXPECT_EQ(rig.loop.energy().out_J(), out_J);
  EXPECT_EQ(rig.hand.truth().motor_torque_Nm.norm(), 0);
  EXPECT_FALSE(anybody(rig.heard));
}

TEST(MasterLoop, TellsTheDeviceToBeOffFromTheStepThatLetsGoOn) {
  MasterRig rig;
  test::Overheard port(rig.cable.host());
  MasterLoop loop(test::desk_device(), test::desk_machine(), port, rig.network.a(), {5, 1h}, ControlLaw::kEchoSpring);
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

}  // namespace
}  // namespace knuckle::master
