// The operator's side behind the window, with a haptic device that is not simulated by it.
#include "app/console/operator_station.h"

#include <gtest/gtest.h>

#include "tests/console/far_rig.h"
#include "tests/support/overheard.h"

namespace knuckle::console {
namespace {

/// A device that somebody holds with enable pressed, and the far end of the link.
struct StationRig {
  StationSetup setup = station_setup(test::live_setup());
  session::HandSide hand{setup.side.device, setup.limb, 1, setup.hand_rad};
  test::Overheard port{hand.cable.host()};
  ImpairedLink network{{}, {}, 1};
  OperatorStation station{setup, network.a(), &port};
  sim::OperatorIntent intent{setup.hand_rad, JointVector::Zero(), true, false, false, false};
  Time now{};
  LinkSession session{{11, 1h}, 200ms};  // the machine's
  MasterMessage sent;
  SlaveMessage slave;
  bool crowded = false;  // with each message come a copy and one of another machine
  MachineStatus status = [this] {
    MachineStatus told;
    told.machine = MachineName(setup.side.machine.name);
    return told;
  }();
  std::uint32_t statuses = 1000;  // that are sent
  [[nodiscard]] ReasonCode reason() {
    ConsoleView view;
    station.show(now, view);
    return view.hand.device.code;
  }

  void run(Duration time) {
    for (const Time until = now + time; now < until;) {
      now += 1ms;
      network.advance(now);
      intent.enable = now > Time(300ms);
      hand.step(now, intent);
      if (now.time_since_epoch() % 50ms == 0ms && status.stamp.sequence < statuses) {
        status.stamp = session.stamp(status.stamp.sequence + 1, now);
        network.b().send(encode(status).view());
      }
      slave.stamp = session.stamp(slave.stamp.sequence + 1, now);
      network.b().send(encode(slave).view());
      if (crowded) {
        SlaveMessage stranger = slave;
        stranger.stamp = LinkSession({77, 3h}, 200ms).stamp(1, now);
        // As one's that hears this side as well.
        stranger.stamp.echoed = slave.stamp.echoed;
        stranger.stamp.echoed_session = slave.stamp.echoed_session;
        network.b().send(encode(slave).view());
        network.b().send(encode(stranger).view());
      }
      station.step(now, HandInput{});
      for (Datagram datagram; network.b().receive(datagram);)
        if (auto message = decode_master(datagram.view())) {
          (void)session.take(message->stamp, now);
          sent = *message;
        }
    }
  }
};

TEST(OperatorStation, TellsTheMachineWhatItsHapticDeviceSaysUnlessNobodyIsAtTheWindow) {
  StationRig rig;
  rig.run(500ms);
  EXPECT_TRUE(rig.sent.device_ok);
  EXPECT_TRUE(rig.sent.presence && rig.sent.enable);
  EXPECT_LT((rig.sent.position_rad - rig.setup.hand_rad).cwiseAbs().maxCoeff(), 0.02);
  ConsoleView view;
  rig.station.show(rig.now, view);
  EXPECT_FALSE(view.hand.device);
  EXPECT_TRUE(view.hand.enable);
  EXPECT_TRUE(view.link.heard);
  rig.station.set_nobody(true);
  rig.run(10ms);
  EXPECT_FALSE(rig.sent.presence || rig.sent.enable || rig.sent.clutch);
  rig.station.set_nobody(false);
  rig.run(10ms);
  EXPECT_TRUE(rig.sent.presence && rig.sent.enable);
}

TEST(OperatorStation, CountsEachMessageOfItsMachineOnceAndNoneOfAnother) {
  const auto seen = [](bool crowded) {
    StationRig rig;
    rig.crowded = crowded;
    rig.run(1s);
    ConsoleView view;
    rig.station.show(rig.now, view);
    EXPECT_EQ(view.link.loss, 0);
    return view.link.round_trip.count();
  };
  EXPECT_GT(seen(false), 900);
  EXPECT_EQ(seen(true), seen(false));
}

TEST(OperatorStation, NobodyLeadsAnotherMachine) {
  StationRig rig;
  rig.status.machine = MachineName("compact080");
  rig.run(500ms);
  EXPECT_TRUE(rig.sent.device_ok);
  EXPECT_FALSE(rig.sent.presence || rig.sent.enable);
  EXPECT_EQ(rig.reason(), ReasonCode::kOtherMachine);
  rig.status.machine = MachineName(rig.setup.side.machine.name);
  rig.run(100ms);
  EXPECT_TRUE(rig.sent.presence && rig.sent.enable);
  EXPECT_EQ(rig.reason(), ReasonCode::kNone);
  rig.status.machine = MachineName("compact080");
  rig.run(100ms);
  EXPECT_FALSE(rig.sent.presence || rig.sent.enable) << "whatever it was before";
}

TEST(OperatorStation, NobodyLeadsBeforeTheMachineHasSaidWhichItIsButAfterwardsItsSilenceIsNoReason) {
  StationRig rig;
  rig.statuses = 0;
  rig.run(900ms);
  EXPECT_FALSE(rig.sent.presence || rig.sent.enable);
  EXPECT_EQ(rig.reason(), ReasonCode::kNone) << "it may still say";
  rig.run(300ms);
  EXPECT_FALSE(rig.sent.presence || rig.sent.enable);
  EXPECT_EQ(rig.reason(), ReasonCode::kMachineNotTold);
  rig.statuses = 1;
  rig.run(2s);
  EXPECT_TRUE(rig.sent.presence && rig.sent.enable);
  EXPECT_EQ(rig.reason(), ReasonCode::kNone);
}

TEST(OperatorStation, StopIsInTheNextMessageUntilReleasedAndLettingGoIsForGood) {
  StationRig rig;
  rig.run(500ms);
  rig.station.set_stop(true);
  rig.run(2ms);
  EXPECT_TRUE(rig.sent.stop);
  rig.station.set_stop(false);
  rig.run(4ms);
  EXPECT_FALSE(rig.sent.stop);
  EXPECT_EQ(rig.port.told.mode, TorqueMode::kTorque);
  rig.station.let_go();
  rig.run(10ms);
  EXPECT_EQ(rig.port.told.mode, TorqueMode::kOff);
  EXPECT_FALSE(rig.sent.presence || rig.sent.enable);
}

}  // namespace
}  // namespace knuckle::console
