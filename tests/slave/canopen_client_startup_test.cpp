// Start-up: who is waited for, for how long, and what a restart forgets.
#include "slave/valve_frame.h"
#include "tests/slave/supervised_bus.h"
#include "tests/support/bus_nodes.h"
#include "tests/support/says.h"

namespace knuckle::slave {
namespace {

using BusStartUp = SupervisedBus;

std::vector<CanFrame> nmt(canopen::NmtCommand command, const std::vector<std::uint8_t>& nodes) {
  std::vector<CanFrame> frames;
  for (const std::uint8_t id : nodes) frames.push_back(canopen::nmt_frame(command, id));
  return frames;
}

/// What was written to nodes' objects.
std::vector<canopen::SdoRequest> writes(const std::vector<CanFrame>& sent) {
  std::vector<canopen::SdoRequest> found;
  for (const CanFrame& frame : sent) {
    const bool request = canopen::function_of(frame.id) == 0x600;
    const auto sdo = request ? canopen::parse_sdo_request(frame) : std::nullopt;
    if (sdo && sdo->kind == canopen::SdoRequest::Kind::kDownload) found.push_back(*sdo);
  }
  return found;
}

/// All arrive but frames under these identifiers.
std::function<bool(CanFrame&)> all_but(std::vector<std::uint32_t> lost) {
  return [lost = std::move(lost)](const CanFrame& frame) {
    return std::find(lost.begin(), lost.end(), frame.id) == lost.end();
  };
}

TEST_F(BusStartUp, TellsOwnNodesOneByOneAndResetsNone) {
  ASSERT_TRUE(bring_to(Phase::kOperational)) << text(client.fault());
  std::vector<CanFrame> expected = nmt(canopen::NmtCommand::kEnterPreOperational, all());
  for (const CanFrame& frame : nmt(canopen::NmtCommand::kStart, all())) expected.push_back(frame);
  EXPECT_EQ(sent(canopen::kNmtId), expected);
}

TEST_F(BusStartUp, ARestartAsksWhatItToldAndWritesOutputsAlone) {
  const Time cold = now;
  up();
  const Duration first = now - cold;
  client.restart();
  const Time since = now;
  ASSERT_TRUE(bring_to(Phase::kOperational)) << text(client.fault());
  const std::vector<canopen::Object> outputs{canopen::kValveControlWord, canopen::kValveSetPoint,
                                             canopen::kEnableOutputs};
  for (const canopen::SdoRequest& written : writes(port.sent)) {
    EXPECT_NE(std::find(outputs.begin(), outputs.end(), written.object), outputs.end())
        << std::hex << written.object.index;
  }
  EXPECT_LE(now - since, first);
  EXPECT_TRUE(std::none_of(port.sent.begin(), port.sent.end(), [](const CanFrame& frame) {
    const auto request = canopen::parse_nmt(frame);
    return request && request->command == canopen::NmtCommand::kResetNode;
  }));
}

TEST_F(BusStartUp, LeavesTheBusRoomForFramesOfTheLowestPriority) {
  constexpr std::uint32_t kProbe = 0x77E;
  const Time begun = now;
  Time heard = now, sent_at = now;
  Duration longest{};
  client.restart();
  for (; now - begun < 2s && !client.operational();) {
    now += 1ms;
    nodes.step(now, {});
    if (now - sent_at >= 10ms) {
      bus.port(1).send({.id = kProbe, .size = 1, .data = {}});
      sent_at = now;
    }
    bus.advance(now);
    for (CanFrame frame; port.receive(frame);) {
      client.receive(frame, now);
      if (frame.id != kProbe) continue;
      longest = std::max(longest, now - heard);
      heard = now;
    }
    if (to_ms(now) % 5 == 0) step();
  }
  ASSERT_TRUE(client.operational()) << text(client.fault());
  EXPECT_LE(longest, 30ms) << "135 ms where all nodes are asked at once";
}

/// An output module that keeps what it was told, and valves that do: the controller was gone, and starts again.
TEST_F(BusStartUp, WhatOutputsWereToldBeforeNeverBecomesTrueAgain) {
  nodes.set_plain_enable();
  up();
  const auto run = [this](Duration most, auto&& each) {
    for (const Time end = now + most; now < end;) {
      tick();
      if (to_ms(now) % 5 == 0) {
        for (CanFrame frame; port.receive(frame);) client.receive(frame, now);
        each();
      }
      if (client.phase() == Phase::kIdle || !client.operational()) {
        EXPECT_FALSE(nodes.outputs().pilot) << to_ms(now);
        EXPECT_EQ(nodes.outputs().spool_demand, JointVector(0, 0, 0)) << to_ms(now);
      }
    }
  };
  run(100ms, [this] { step(passed(kArm, 0.3), true); });
  ASSERT_TRUE(client.operational()) << text(client.fault());
  ASSERT_TRUE(nodes.outputs().pilot);
  ASSERT_GT(nodes.outputs().spool_demand[kArm], 0.2);
  leave_nodes_alone(400);  // the controller is gone
  client.restart();
  run(2s, [this] { step(); });
  EXPECT_TRUE(client.operational()) << text(client.fault());
  EXPECT_FALSE(nodes.outputs().pilot);
}

TEST_F(BusStartUp, ARestartOfWhatMovesGoesToNeutralAtOnce) {
  up();
  step(passed(kArm, 0.3), true);
  step(passed(kArm, 0.3), true);
  client.restart();
  port.sent.clear();
  step(passed(kArm, 0.3), true);
  const auto commands = sent(canopen::rpdo1_id(0x11));
  ASSERT_EQ(commands.size(), 1U);
  EXPECT_EQ(canopen::parse_valve_command(commands[0])->set_point, 0);
  ASSERT_EQ(sent(canopen::rpdo1_id(kEnableNode)).size(), 1U);
  EXPECT_EQ(sent(canopen::rpdo1_id(kEnableNode))[0].data[0], 0);
}

TEST_F(BusStartUp, WaitsForANodeThatBootsForSoLongAsTheFileSays) {
  nodes.node(0x31)->set_boot_time(900ms);
  ASSERT_TRUE(bring_to(Phase::kOperational)) << text(client.fault());
  client.restart();
  EXPECT_TRUE(bring_to(Phase::kOperational, {}, 900ms)) << "what has booted costs no second boot";
}

TEST_F(BusStartUp, ResetsTheOneNodeThatDoesNotTakeWhatItIsToldAndOnlyOnce) {
  sim::NodeProtocol& tilt = *nodes.node(0x38);
  tilt.set_boot_time(200ms);
  tilt.refuse(canopen::kTpdo1Type, canopen::SdoAbort::kDeviceState);
  ASSERT_TRUE(bring_to(Phase::kFailed));
  EXPECT_EQ(text(client.setup_failure(), client.bus()),
            "tilt (node 0x38): writing 0x1800:02 was refused: " +
                std::string(canopen::abort_text(canopen::SdoAbort::kDeviceState)) + " (SDO abort 0x08000022)");
  std::vector<CanFrame> resets = sent(canopen::kNmtId);
  std::erase_if(resets, [](const CanFrame& frame) {
    return canopen::parse_nmt(frame)->command != canopen::NmtCommand::kResetNode;
  });
  EXPECT_EQ(resets, nmt(canopen::NmtCommand::kResetNode, {0x38}));
  tilt.refuse(canopen::kTpdo1Type, canopen::SdoAbort::kNone);
  client.restart();
  EXPECT_TRUE(bring_to(Phase::kOperational)) << text(client.fault());
}

TEST_F(BusStartUp, TakesAMappingThatNobodyMayWriteWhereItBeginsAsWanted) {
  sim::NodeProtocol& tilt = *nodes.node(0x38);
  const canopen::Object lateral{0x6020, 0}, entry_2{0x1A00, 2};
  tilt.add(lateral, 2, sim::Access::kReadOnly);
  tilt.replace(entry_2, canopen::mapping(lateral, 16));
  tilt.replace(canopen::kTpdo1MapCount, 2);
  tilt.replace(canopen::kTpdo1CobId, 0x40000000U | canopen::tpdo1_id(0x38));  // and no remote requests
  tilt.refuse(canopen::kTpdo1CobId, canopen::SdoAbort::kReadOnly);
  ASSERT_TRUE(bring_to(Phase::kOperational)) << text(client.setup_failure(), client.bus());
  bool heard = false;
  const auto length = [&heard](CanFrame& frame) {
    if (frame.id == canopen::tpdo1_id(0x38)) heard = frame.size == 4;
    return true;
  };
  (void)bring_to(Phase::kFailed, length, 50ms);
  EXPECT_TRUE(heard);
}

TEST_F(BusStartUp, AValveNeedsOneGuardOfTwo) {
  sim::NodeProtocol& valve = *nodes.node(0x11);
  valve.remove(canopen::kConsumerHeartbeat);
  ASSERT_TRUE(bring_to(Phase::kOperational)) << text(client.setup_failure(), client.bus());
  valve.remove(canopen::kRpdo1Timer);
  client.restart();
  ASSERT_TRUE(bring_to(Phase::kFailed));
  expect_fault(ReasonCode::kNodeSetup, 0x11, client.fault().value, client.fault().limit);
  EXPECT_TRUE(test::begins(text(client.setup_failure(), client.bus()), "arm_valve (node 0x11): takes no guard "));
}

TEST_F(BusStartUp, AGuardThatIsAcceptedButNotKeptIsNone) {
  // As if the device forgot what it was told: both answers to "what is it" are 0.
  const auto forgets = [](CanFrame& frame) {
    const auto answer = frame.id == canopen::sdo_response_id(0x11) ? canopen::parse_sdo_response(frame) : std::nullopt;
    const bool guard =
        answer && (answer->object == canopen::kRpdo1Timer || answer->object == canopen::kConsumerHeartbeat);
    if (guard && answer->kind == canopen::SdoResponse::Kind::kUploaded)
      frame = canopen::sdo_uploaded(0x11, answer->object, 0, answer->size);
    return true;
  };
  ASSERT_TRUE(bring_to(Phase::kFailed, forgets));
  EXPECT_EQ(client.setup_failure().what, SetupFailure::What::kUnguarded);
}

TEST_F(BusStartUp, AnErrorThatANodeStillHasEndsTheStartAfterAResetAndOneThatIsOverDoesNot) {
  up();
  nodes.node(0x25)->set_error(true);
  nodes.send_emcy(0x25, canopen::kEmcySensor);
  nodes.node(0x25)->replace(canopen::kErrorRegister, 1);
  ASSERT_TRUE(bring_to(Phase::kFailed));
  expect_fault(ReasonCode::kNodeEmergency, 0x25, canopen::kEmcySensor, 0);
  client.restart();
  port.sent.clear();
  ASSERT_TRUE(bring_to(Phase::kFailed));
  expect_fault(ReasonCode::kNodeEmergency, 0x25, canopen::kEmcySensor, 0);
  const CanFrame reset = canopen::nmt_frame(canopen::NmtCommand::kResetNode, 0x25);
  EXPECT_EQ(std::count(port.sent.begin(), port.sent.end(), reset), 1);
  nodes.node(0x25)->set_error(false);
  client.restart();
  EXPECT_TRUE(bring_to(Phase::kOperational)) << text(client.fault());
}

TEST_F(BusStartUp, ANodeThatDoesNotStartIsNamedAfterASecond) {
  const auto never_started = [](CanFrame& frame) {
    const bool of_them = frame.id == canopen::heartbeat_id(0x22) || frame.id == canopen::heartbeat_id(0x32);
    return !of_them || canopen::parse_heartbeat(frame) == canopen::NmtState::kBootUp;
  };
  ASSERT_TRUE(bring_to(Phase::kStarting, never_started)) << text(client.fault());
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
  const auto silent = all_but({canopen::heartbeat_id(0x22), canopen::tpdo1_id(0x12)});
  ASSERT_TRUE(bring_to(Phase::kFailed, silent)) << text(client.fault());
  EXPECT_TRUE(test::is(client.fault(), ReasonCode::kNodeSilent, 0x22));

  const auto unheard_valve = all_but({canopen::tpdo1_id(0x12)});
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

TEST_F(BusStartUp, ANodeHasAnIdOfItsOwnBetween1And127) {
  const auto accepted = [this](std::uint8_t tilt_id, std::uint8_t controller_id) {
    MachineDescription d = machine;
    test::node_in(d.bus, NodeRole::kTilt).id = tilt_id;
    d.bus.controller_id = controller_id;
    try {
      CanopenClient made(d, port);
    } catch (const InputError& refusal) {
      EXPECT_TRUE(test::says(std::string(refusal.what()), "node id " + std::to_string(tilt_id)));
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
  ASSERT_TRUE(bring_to(Phase::kFailed, all_but({canopen::tpdo1_id(kEnableNode)})));
  EXPECT_TRUE(test::is(client.fault(), ReasonCode::kSensorStale, kEnableNode));
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
  ASSERT_TRUE(bring_to(Phase::kActivating, all_but({canopen::tpdo1_id(0x12)}))) << text(client.fault());
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
    now += 5ms;
    status(0x12, says);
    status(0x11, canopen::kControlHold | canopen::kStatusReady);  // it, too, must be active before all is well
    port.sent.clear();
    for (int i = 0; i < 2; ++i) step();
    const std::vector<CanFrame> commands = sent(to_valve);
    ASSERT_EQ(commands.size(), 1U) << "every second SYNC";
    EXPECT_EQ(canopen::parse_valve_command(commands[0])->control_word, told) << says;
    EXPECT_EQ(client.phase(), Phase::kActivating);
  }
  statuses_but(0);
  inputs();
  step();
  EXPECT_EQ(client.phase(), Phase::kChecking) << text(client.fault());
}

MachineDescription machine_with_pved_valves() {
  MachineDescription d = machine_with_exact_limits();
  for (NodeDescription& valve : d.bus.nodes) valve.profile = ValveProfile::kPved;  // of a valve
  return d;
}

class PvedValves : public SupervisedBus {
 protected:
  PvedValves() : SupervisedBus(machine_with_pved_valves()) {}
  /// Control words that a valve was told, each once in a row.
  std::vector<int> words(std::uint8_t valve) const {
    std::vector<int> told;
    for (const CanFrame& frame : sent(canopen::rpdo1_id(valve))) {
      const int word = canopen::parse_valve_command(frame)->control_word;
      if (told.empty() || told.back() != word) told.push_back(word);
    }
    return told;
  }
};

TEST_F(PvedValves, AreLedThroughTheirStatesByTheirOwnWordsAndOutOfAFaultByTheirOwnEdge) {
  ASSERT_TRUE(bring_to(Phase::kOperational)) << text(client.fault());
  EXPECT_EQ(words(0x11), (std::vector<int>{0x08, 0x09, 0x0B, 0x0F}));
  up_again();
  ASSERT_TRUE(client.operational());
  client.restart();
  port.sent.clear();
  for (int ms = 0; ms < 300; ++ms) tick();  // without set-points: a fault of the valves'
  ASSERT_TRUE(bring_to(Phase::kOperational)) << text(client.fault());
  EXPECT_EQ(words(0x11), (std::vector<int>{0x08, 0x03, 0x0B, 0x08, 0x09, 0x0B, 0x0F}));
}

TEST_F(PvedValves, MayTakeTenSecondsToBoot) {
  for (const std::uint8_t valve : std::initializer_list<std::uint8_t>{0x10, 0x11, 0x12})
    nodes.node(valve)->set_boot_time(9s);
  EXPECT_TRUE(bring_to(Phase::kOperational, {}, 12s)) << text(client.fault());
}

TEST_F(PvedValves, AreNeverToldToFloat) {
  machine.bus.wire.valve_full_stroke = 32766;
  for (int i = -100; i <= 100; ++i) {
    const CanFrame frame = valve_frame(machine.bus, kArm, 0x0F, passed(kArm, 0.0034 * i));
    const auto raw = static_cast<std::int16_t>(frame.data[2] | frame.data[3] << 8);
    EXPECT_LE(std::abs(int{raw}), 32766);
    EXPECT_NEAR(raw, 0.0034 * i * 32766, 1);
  }
}

}  // namespace
}  // namespace knuckle::slave
