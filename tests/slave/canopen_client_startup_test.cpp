// Start-up: who is waited for, for how long, and what a restart forgets.
#include "tests/slave/supervised_bus.h"

namespace knuckle::slave {
namespace {

using BusStartUp = SupervisedBus;

TEST_F(BusStartUp, StartUpWaitsForEveryBootMessageButNotForEver) {
  client.begin_step(now);
  ASSERT_EQ(client.phase(), Phase::kResetting);
  for (const std::uint8_t id : all()) {
    if (id != 0x31) heartbeat(id, canopen::NmtState::kBootUp);
  }
  now += 1s;
  client.begin_step(now);
  EXPECT_EQ(client.phase(), Phase::kResetting);
  now += 1ns;
  client.begin_step(now);
  EXPECT_EQ(client.phase(), Phase::kConfiguring);

  client.restart();
  client.begin_step(now);
  for (const std::uint8_t id : all()) heartbeat(id, canopen::NmtState::kBootUp);
  client.begin_step(now);
  EXPECT_EQ(client.phase(), Phase::kConfiguring) << "all have booted";
  const std::vector<CanFrame> told = sent(canopen::kNmtId);
  ASSERT_EQ(told.size(), 4U);
  EXPECT_EQ(told[2], canopen::nmt_frame(canopen::NmtCommand::kResetNode, 0));
  EXPECT_EQ(told[3], canopen::nmt_frame(canopen::NmtCommand::kEnterPreOperational, 0));
}

TEST_F(BusStartUp, ANodeThatDoesNotStartIsNamedAfterASecond) {
  const auto never_started = [](CanFrame& frame) {
    const bool of_them = frame.id == canopen::heartbeat_id(0x22) || frame.id == canopen::heartbeat_id(0x32);
    return !of_them || canopen::parse_heartbeat(frame) == canopen::NmtState::kBootUp;
  };
  ASSERT_TRUE(bring_to(Phase::kStarting, never_started)) << text(client.fault());
  EXPECT_EQ(sent(canopen::kNmtId).back(), canopen::nmt_frame(canopen::NmtCommand::kStart, 0));
  const Time since = now;
  ASSERT_TRUE(bring_to(Phase::kFailed, never_started));
  EXPECT_EQ(now - since, 1005ms);
  expect_fault(ReasonCode::kNodeSilent, 0x22, 1005, 1000);
}

TEST_F(BusStartUp, ARestartBelievesNothingFromBefore) {
  up();
  const PassedCommands open = passed(kArm, 0.3);
  for (int i = 0; i < 2; ++i) step(open);
  client.restart();
  EXPECT_EQ(client.demand(), JointVector(0, 0, 0));
  // A node that says nothing any more has neither booted nor started, and a valve that is not heard is in no state.
  const auto silent = [](CanFrame& frame) {
    return frame.id != canopen::heartbeat_id(0x22) && frame.id != canopen::tpdo1_id(0x12);
  };
  ASSERT_TRUE(bring_to(Phase::kResetting));
  const Time reset_at = now;
  ASSERT_TRUE(bring_to(Phase::kConfiguring, silent));
  EXPECT_EQ(now - reset_at, 1005ms);
  ASSERT_TRUE(bring_to(Phase::kFailed, silent)) << text(client.fault());
  EXPECT_EQ(client.fault().code, ReasonCode::kNodeSilent) << text(client.fault());
  EXPECT_EQ(client.fault().subject, 0x22);

  const auto unheard_valve = [](CanFrame& frame) { return frame.id != canopen::tpdo1_id(0x12); };
  client.restart();
  ASSERT_TRUE(bring_to(Phase::kOperational)) << text(client.fault());
  client.restart();
  ASSERT_TRUE(bring_to(Phase::kActivating, unheard_valve)) << text(client.fault());
  port.sent.clear();
  step();
  step();
  for (const CanFrame& frame : sent(canopen::rpdo1_id(0x12)))
    EXPECT_EQ(canopen::parse_valve_command(frame)->control_word, canopen::kControlInit);
}

TEST_F(BusStartUp, ASetUpThatFailedIsForgottenByARestart) {
  const auto mute = [](CanFrame& frame) { return frame.id != canopen::sdo_response_id(0x22); };
  ASSERT_TRUE(bring_to(Phase::kFailed, mute));
  EXPECT_EQ(client.setup_failure().what, SetupFailure::What::kSilent);
  client.restart();
  EXPECT_EQ(client.setup_failure().what, SetupFailure::What::kNone);
}

TEST_F(BusStartUp, ANodeHasAnIdOfItsOwnBetween1And127) {
  const auto accepted = [this](std::uint8_t tilt_id, std::uint8_t controller_id) {
    MachineDescription d = machine;
    d.bus.tilt.id = tilt_id;
    d.bus.controller_id = controller_id;
    try {
      CanopenClient made(d, port);
    } catch (const InputError& refusal) {
      EXPECT_NE(std::string(refusal.what()).find("node id " + std::to_string(tilt_id)), std::string::npos);
      return false;
    }
    return true;
  };
  EXPECT_FALSE(accepted(0, 5));
  EXPECT_TRUE(accepted(1, 5));
  EXPECT_FALSE(accepted(5, 5));
  EXPECT_FALSE(accepted(0x31, 5)) << "an encoder's";
  EXPECT_TRUE(accepted(127, 5));
  EXPECT_FALSE(accepted(128, 5));
}

TEST_F(BusStartUp, AValveThatDoesNotBecomeActiveIsNamedAfterHalfASecond) {
  const auto stays_in_hold = [](CanFrame& frame) {
    if (frame.id == canopen::tpdo1_id(0x11))
      frame = canopen::valve_status_frame(frame.id, {canopen::kControlHold | canopen::kStatusReady, 0});
    return true;
  };
  ASSERT_TRUE(bring_to(Phase::kActivating, stays_in_hold)) << text(client.fault());
  const Time since = now;
  ASSERT_TRUE(bring_to(Phase::kFailed, stays_in_hold));
  EXPECT_EQ(now - since, 505ms);
  expect_fault(ReasonCode::kNodeFault, 0x11, canopen::kControlHold | canopen::kStatusReady, kWell);
}

TEST_F(BusStartUp, AnEnableNodeThatNeverSpeaksIsNamed) {
  const auto without_inputs = [](CanFrame& frame) { return frame.id != canopen::tpdo1_id(kEnableNode); };
  ASSERT_TRUE(bring_to(Phase::kFailed, without_inputs));
  EXPECT_EQ(client.fault().code, ReasonCode::kSensorStale) << text(client.fault());
  EXPECT_EQ(client.fault().subject, kEnableNode);
  EXPECT_TRUE(text(client.fault()).ends_with("(never yet)")) << "no age of what never was: " << text(client.fault());
}

TEST_F(BusStartUp, AValveIsTakenToActiveStateByState) {
  // What the valve says, and what it is told next.
  const std::pair<std::uint16_t, std::uint16_t> steps[] = {
      {canopen::kStatusReady, canopen::kControlDisabled},
      {canopen::kControlDisabled | canopen::kStatusReady, canopen::kControlHold},
      {canopen::kControlHold | canopen::kStatusReady, canopen::kControlActive},
      {kWell, canopen::kControlActive},
      {0x2 | canopen::kStatusReady, canopen::kControlInit},  // no state of the profile
      {canopen::kControlHold, canopen::kControlReset},       // in fault: an edge ...
      {canopen::kControlHold, canopen::kControlInit},        // ... that is made again if it did not help
      {canopen::kControlHold, canopen::kControlReset}};
  const auto not_heard = [](CanFrame& frame) { return frame.id != canopen::tpdo1_id(0x12); };
  ASSERT_TRUE(bring_to(Phase::kActivating, not_heard)) << text(client.fault());
  const std::uint32_t to_valve = canopen::rpdo1_id(0x12);
  port.sent.clear();
  status(0x10);
  inputs();
  step();
  step();
  ASSERT_FALSE(sent(to_valve).empty());
  EXPECT_EQ(canopen::parse_valve_command(sent(to_valve).back())->control_word, canopen::kControlInit)
      << "not heard of yet";
  for (const auto& [says, told] : steps) {
    status(0x12, says);
    status(0x11, canopen::kControlHold | canopen::kStatusReady);  // it, too, must be active before all is well
    port.sent.clear();
    for (int i = 0; i < 2; ++i) step();
    const std::vector<CanFrame> commands = sent(to_valve);
    ASSERT_EQ(commands.size(), 1U) << "every second SYNC";
    EXPECT_EQ(canopen::parse_valve_command(commands[0])->control_word, told) << says;
    EXPECT_EQ(client.phase(), Phase::kActivating);
  }
  status(0x11);
  status(0x12);
  step();
  EXPECT_TRUE(client.operational()) << text(client.fault());
}

}  // namespace
}  // namespace knuckle::slave
