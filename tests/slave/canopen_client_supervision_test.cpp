// Supervision of a bus that is up, to the nanosecond and the digit, and what is sent meanwhile: the simulated nodes
// bring it up, then every frame is the test's.
#include "tests/slave/supervised_bus.h"

namespace knuckle::slave {
namespace {

using BusSupervision = SupervisedBus;

TEST_F(BusSupervision, ANodeIsSilentBeyondItsTimeoutAndNotBefore) {
  for (const std::uint8_t silent : all()) {
    up_again();
    now += 250ms;
    all_live(silent);
    step_across_border();
    expect_fault(ReasonCode::kNodeSilent, silent, 250, 250);
  }
}

TEST_F(BusSupervision, AnEmergencyCountsUntilItIsReset) {
  up();
  const std::uint64_t before = client.emergencies().count();
  client.receive(canopen::emergency_frame(0x24, {0x5030, 1, {}}), now);
  client.receive(canopen::emergency_frame(0x24, {canopen::kEmcyReset, 0, {}}), now);
  step();
  EXPECT_TRUE(client.operational()) << text(client.fault());
  EXPECT_EQ(client.emergencies().count(), before + 2);
  EXPECT_EQ(client.emergencies().newest(1).node, 0x24);
  EXPECT_EQ(client.emergencies().newest(1).at, now);
  client.receive(canopen::emergency_frame(0x24, {0x5030, 1, {}}), now);
  step();
  expect_fault(ReasonCode::kNodeEmergency, 0x24, 0x5030, 0);
  client.receive(canopen::emergency_frame(0x24, {canopen::kEmcyReset, 0, {}}), now);
  step();
  EXPECT_EQ(client.phase(), Phase::kFailed) << "nothing resumes by itself";
  up_again();
}

TEST_F(BusSupervision, AnErrorThatIsOverEndsNoEmergencyWhileTheNodeHasAnother) {
  up();
  client.receive(canopen::emergency_frame(0x24, {0x5030, 0x21, {}}), now);
  client.receive(canopen::emergency_frame(0x24, {0x3110, 0x25, {}}), now);
  client.receive(canopen::emergency_frame(0x24, {canopen::kEmcyReset, 0x21, {}}), now);
  step();
  expect_fault(ReasonCode::kNodeEmergency, 0x24, 0x3110, 0);
  client.receive(canopen::emergency_frame(0x24, {canopen::kEmcyReset, 0, {}}), now);
  up_again();
  client.receive(canopen::emergency_frame(0x24, {canopen::kEmcyReset, 0x01, {}}), now);  // nobody heard which
  step();
  expect_fault(ReasonCode::kNodeEmergency, 0x24, canopen::kEmcyGeneric, 0);
}

TEST_F(BusSupervision, ANodeThatLeavesItsWorkingStateIsLostThoughItComesBackAtOnce) {
  using canopen::NmtState;
  for (const NmtState left : {NmtState::kStopped, NmtState::kPreOperational, NmtState::kBootUp}) {
    for (const std::uint8_t id : all()) {
      up_again();
      heartbeat(id, left);
      heartbeat(id, NmtState::kOperational);
      heartbeat(id, NmtState::kStopped);  // what came first is told
      step();
      expect_fault(ReasonCode::kNodeFault, id, static_cast<int>(left), static_cast<int>(NmtState::kOperational));
    }
  }
}

TEST_F(BusSupervision, AValvesStatusMayBeAsOldAsTheSensorLimitAndOnePeriod) {
  for (std::uint8_t old = kValve; old < kValve + 3; ++old) {
    up_again();
    now += from_seconds(0.03125 + 2.0 / 256);
    statuses_but(old);
    inputs();
    step_across_border();
    expect_fault(ReasonCode::kSensorStale, old, 39.0625, 39.0625);
  }
}

TEST_F(BusSupervision, AFrameShorterThanMappedIsNotUsedAndToldWhereItIsMissed) {
  up();
  now += from_seconds(0.03125 + 2.0 / 256);
  statuses_but(0x11);
  inputs();
  client.receive({0x191, 2, {0x0F, 0}}, now);
  step_across_border();
  expect_fault(ReasonCode::kFrameShort, 0x11, 2, 4);
  up_again();
  now += from_seconds(3 * 0.0625) + 1ns;
  statuses_but(0);
  client.receive({0x1C0, 0, {}}, now);
  step();
  expect_fault(ReasonCode::kFrameShort, kEnableNode, 0, 1);
}

// Its status is missed after 39 ms; its heartbeat comes ten times a second.
TEST_F(BusSupervision, AValveThatLeftItsWorkingStateIsMissedFirstAndThenToldAsThat) {
  using canopen::NmtState;
  const auto missed = [this](Duration heartbeat_after, std::uint8_t told, NmtState state) {
    up_again();
    now += 40ms;
    statuses_but(0x11);
    inputs();
    step();
    EXPECT_TRUE(test::is(client.fault(), ReasonCode::kSensorStale));
    now += heartbeat_after;
    heartbeat(told, state);
    step();
    EXPECT_EQ(client.phase(), Phase::kFailed);
  };
  missed(50ms, 0x11, NmtState::kPreOperational);
  expect_fault(ReasonCode::kNodeFault, 0x11, 127, 5);
  missed(50ms, 0x11, NmtState::kOperational);
  EXPECT_TRUE(test::is(client.fault(), ReasonCode::kSensorStale)) << "it works, and its status does not come";
  missed(50ms, 0x12, NmtState::kPreOperational);
  EXPECT_TRUE(test::is(client.fault(), ReasonCode::kSensorStale)) << "another one";
  missed(400ms, 0x11, NmtState::kPreOperational);
  EXPECT_TRUE(test::is(client.fault(), ReasonCode::kSensorStale)) << "it was cut off meanwhile, and gave up for that";
}

TEST_F(BusSupervision, ANodeThatSomebodyElseTellsToRestIsToldAtOnceAndThenWhoToldItSo) {
  using canopen::NmtCommand;
  const std::pair<NmtCommand, int> commands[] = {{NmtCommand::kEnterPreOperational, 127}, {NmtCommand::kStop, 4}};
  for (const auto& [command, state] : commands) {
    now += 2s;  // the last one is forgotten
    up_again();
    client.receive(canopen::nmt_frame(command, 0x22), now);
    step();
    expect_fault(ReasonCode::kNodeFault, 0x22, state, 5);
    now += 5ms;
    step();
    EXPECT_TRUE(test::is(client.fault(), ReasonCode::kOtherController));
  }
  for (const NmtCommand command : {NmtCommand::kStart, NmtCommand::kResetNode}) {
    now += 2s;  // the last one is forgotten
    up_again();
    client.receive(canopen::nmt_frame(command, 0x22), now);
    if (command == NmtCommand::kResetNode) heartbeat(0x22, canopen::NmtState::kBootUp);
    step();
    EXPECT_TRUE(test::is(client.fault(), ReasonCode::kOtherController));
  }
}

TEST_F(BusSupervision, ASpoolBeyondWhatIsPossibleIsNoPosition) {
  for (const double sign : {1.0, -1.0}) {
    up_again();
    status(0x11, kWell, sign * 1.0999);
    step();
    EXPECT_TRUE(client.operational()) << text(client.fault());
    status(0x11, kWell, sign * 1.1001);
    step();
    expect_fault(ReasonCode::kSensorInvalid, 0x11, sign * 1.1001, 1.1);
  }
}

TEST_F(BusSupervision, AValveMustBeActiveWellAndLedFromTheBus) {
  const std::uint16_t words[] = {canopen::kControlHold | canopen::kStatusReady,
                                 canopen::kControlDisabled | canopen::kStatusReady, canopen::kStatusReady,
                                 canopen::kControlActive, static_cast<std::uint16_t>(kWell | canopen::kStatusLocal)};
  for (const std::uint16_t word : words) {
    for (std::uint8_t id = kValve; id < kValve + 3; ++id) {
      up_again();
      status(id, word);
      step();
      expect_fault(ReasonCode::kNodeFault, id, word, kWell);
    }
  }
}

TEST_F(BusSupervision, EnableInputsAreStaleAfterThreeHeartbeats) {
  up();
  now += from_seconds(3 * 0.0625);
  statuses_but(0);
  step_across_border();
  expect_fault(ReasonCode::kSensorStale, kEnableNode, 187.5, 187.5);
}

TEST_F(BusSupervision, EnableInputsSayEStopAndPilot) {
  EXPECT_FALSE(client.e_stop_open()) << "not known yet";
  EXPECT_FALSE(client.pilot_on());
  up();
  for (std::uint8_t bits = 0; bits < 8; ++bits) {
    inputs(bits);
    EXPECT_EQ(client.e_stop_open(), (bits & 1) == 0);
    EXPECT_EQ(client.pilot_on(), (bits & 2) != 0);
  }
  client.restart();
  EXPECT_FALSE(client.e_stop_open());
  EXPECT_FALSE(client.pilot_on());
}

// ---- what is sent

/// Set-points every so-many-th SYNC; every second one: below.
class SetPointPeriod : public SupervisedBus, public ::testing::WithParamInterface<int> {
 protected:
  SetPointPeriod() : SupervisedBus(described(GetParam())) {}
  static MachineDescription described(int every_nth_sync) {
    MachineDescription d = machine_with_exact_limits();
    d.bus.set_point_every_nth_sync = every_nth_sync;
    return d;
  }
};

TEST_P(SetPointPeriod, IsWhatTheMachineFileSays) {
  up();
  port.sent.clear();
  for (int i = 0; i < 12; ++i) step();
  for (int i = 0; i < kJoints; ++i) EXPECT_EQ(sent_to_valve(i).size(), 12U / static_cast<unsigned>(GetParam())) << i;
}
INSTANTIATE_TEST_SUITE_P(Each, SetPointPeriod, ::testing::Values(1, 3));

TEST_F(BusSupervision, SetPointsGoOutEverySecondSyncAndADropAtOnce) {
  up();
  const auto commands_of = [this](int joint) { return sent_to_valve(joint).size(); };
  for (int joint = 0; joint < kJoints; ++joint) {
    const PassedCommands open = passed(joint, joint == 1 ? -0.3 : 0.3);
    port.sent.clear();
    for (int i = 0; i < 6; ++i) step(open);
    for (int i = 0; i < kJoints; ++i) EXPECT_EQ(commands_of(i), 3U);
    EXPECT_EQ(client.demand(), open.value());
    for (int i = 0; i < 3; ++i) {  // until none is due next
      port.sent.clear();
      step(open);
      if (commands_of(joint) != 0) break;
    }
    port.sent.clear();
    now += 1ms;
    step();
    for (int i = 0; i < kJoints; ++i) EXPECT_EQ(commands_of(i), i == joint ? 1U : 0U) << "only what drops";
    EXPECT_EQ(client.demand(), JointVector(0, 0, 0));
    EXPECT_EQ(client.set_points_at(), now);
  }
}

TEST_F(BusSupervision, WhatTheControllerDidNotTakeIsNotOnTheWire) {
  up();
  const PassedCommands open = passed(kArm, 0.3);
  for (int i = 0; i < 2; ++i) step(open);
  const Time taken_at = now;
  port.full = true;
  now += 1ms;
  for (int i = 0; i < 2; ++i) step();
  EXPECT_EQ(client.demand(), open.value());
  EXPECT_EQ(client.set_points_at(), taken_at);
  port.full = false;
  step();
  EXPECT_EQ(client.demand(), JointVector(0, 0, 0));
  EXPECT_EQ(client.set_points_at(), now);
}

TEST_F(BusSupervision, EnableOutputGoesOutOnChangeAndEveryTenthSync) {
  up();
  const std::uint32_t id = canopen::rpdo1_id(kEnableNode);
  port.sent.clear();
  for (int i = 0; i < 40; ++i) step();
  ASSERT_EQ(sent(id).size(), 4U);
  EXPECT_EQ(canopen::parse_enable(sent(id).back()), 0);
  for (int i = 0; i < 20 && sent(id).size() != 5; ++i) step();  // the next regular one is ten steps away
  for (const bool on : {true, false}) {
    port.sent.clear();
    step({}, on);
    ASSERT_EQ(sent(id).size(), 1U);
    EXPECT_EQ(canopen::parse_enable(sent(id).back()), on ? canopen::kOutputEnable : 0);
    step({}, on);
    EXPECT_EQ(sent(id).size(), 1U);
  }
}

TEST_F(BusSupervision, EnableOutputThatTheControllerDidNotTakeIsSentAgainAtOnce) {
  up();
  const std::uint32_t id = canopen::rpdo1_id(kEnableNode);
  for (int k = 0; k < 5; ++k) {  // every six steps: at most one of them meets a regular one
    for (int i = 0; i < 4; ++i) step({}, true);
    port.full = true;
    step({}, false);
    port.full = false;
    port.sent.clear();
    step({}, false);
    ASSERT_EQ(sent(id).size(), 1U) << k;
    EXPECT_EQ(canopen::parse_enable(sent(id).back()), 0);
  }
}

TEST_F(BusSupervision, AFailedBusIsToldNeutralAndNoEnableWhateverIsAsked) {
  up();
  const PassedCommands open = passed(kBoom, 0.3);
  for (int i = 0; i < 2; ++i) step(open, true);
  client.receive(canopen::emergency_frame(0x24, {0x5030, 1, {}}), now);
  port.sent.clear();
  for (int i = 0; i < 20; ++i) step(open, true);
  ASSERT_EQ(client.phase(), Phase::kFailed);
  for (int i = 0; i < kJoints; ++i) {
    const auto commands = sent_to_valve(i);
    EXPECT_GE(commands.size(), 10U);
    for (const CanFrame& frame : commands) EXPECT_EQ(canopen::parse_valve_command(frame)->set_point, 0);
  }
  ASSERT_FALSE(sent(canopen::rpdo1_id(kEnableNode)).empty());
  for (const CanFrame& frame : sent(canopen::rpdo1_id(kEnableNode))) EXPECT_EQ(canopen::parse_enable(frame), 0);
}

}  // namespace
}  // namespace knuckle::slave
