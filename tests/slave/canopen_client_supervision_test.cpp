// Supervision of a bus that is up, to the nanosecond and the digit: the simulated nodes bring it up, then every frame
// is the test's.
#include <gtest/gtest.h>

#include <functional>
#include <vector>

#include "core/error.h"
#include "sim/can_nodes.h"
#include "slave/canopen_client.h"
#include "tests/slave/test_machine.h"
#include "transport/canopen.h"
#include "transport/virtual_can.h"

namespace knuckle::slave {
namespace {

using Phase = CanopenClient::Phase;

constexpr std::uint8_t kValve = 0x10, kEnableNode = 0x40;
constexpr std::uint16_t kWell = canopen::kControlActive | canopen::kStatusReady;
constexpr std::uint8_t kClosedAndOn = canopen::kInputEStopClosed | canopen::kInputPilotOn;

/// A port that keeps what is sent and can be full.
class WatchedPort final : public CanBus {
 public:
  explicit WatchedPort(CanBus& port) : port_(port) {}
  bool send(const CanFrame& frame) noexcept override {
    if (full) return false;
    sent.push_back(frame);
    (void)port_.send(frame);  // the wire itself is not asked: nothing moves it on once all is up
    return true;
  }
  bool receive(CanFrame& frame) noexcept override { return port_.receive(frame); }
  [[nodiscard]] CanState state() const noexcept override { return state_now; }

  std::vector<CanFrame> sent;
  bool full = false;
  CanState state_now = CanState::kActive;

 private:
  CanBus& port_;
};

/// Limits that binary fractions say exactly: a border is a border.
MachineDescription machine_with_exact_limits() {
  MachineDescription d = test::test_machine();
  d.bus.sensor_age_limit_s = 0.03125;
  d.bus.sync_Hz = 256;  // a status every 2 / 256 s
  d.bus.controller_heartbeat_s = 0.0625;
  return d;
}

class BusSupervision : public ::testing::Test {
 protected:
  using Filter = std::function<bool(CanFrame&)>;  // false: does not arrive

  /// Up to this phase by the simulated nodes, a step every 5 ms; at most so long.
  bool bring_to(Phase phase, const Filter& arrives = {}, Duration most = 4s) {
    for (const Time end = now + most; now < end;) {
      now += 1ms;
      nodes.step(now, {});
      bus.advance(now);
      if (to_ms(now) % 5 != 0) continue;
      for (CanFrame frame; port.receive(frame);) {
        if (!arrives || arrives(frame)) client.receive(frame, now);
      }
      step();
      if (client.phase() == phase) return true;
    }
    return false;
  }
  static std::int64_t to_ms(Time t) { return t.time_since_epoch() / 1ms; }
  void step(const PassedCommands& commands = {}, bool enable = false) {
    client.begin_step(now);
    client.end_step(commands, enable, now);
  }
  void heartbeat(std::uint8_t id, canopen::NmtState state = canopen::NmtState::kOperational) {
    client.receive(canopen::heartbeat_frame(id, state), now);
  }
  void status(std::uint8_t id, std::uint16_t word = kWell, double spool = 0) {
    client.receive(canopen::valve_status_frame(canopen::tpdo1_id(id), {word, spool}), now);
  }
  void inputs(std::uint8_t bits = kClosedAndOn) {
    client.receive(canopen::enable_inputs_frame(canopen::tpdo1_id(kEnableNode), bits), now);
  }
  void all_live(std::uint8_t but = 0) {
    for (const std::uint8_t id : all()) {
      if (id != but) heartbeat(id);
    }
    for (std::uint8_t id = kValve; id < kValve + 3; ++id) status(id);
    inputs();
  }
  static std::vector<std::uint8_t> all() {
    return {0x10, 0x11, 0x12, 0x20, 0x21, 0x22, 0x23, 0x24, 0x25, 0x30, 0x31, 0x32, 0x38, 0x40};
  }
  void expect_fault(ReasonCode code, int subject, double value, double limit) {
    const Reason& why = client.fault();
    EXPECT_EQ(why.code, code) << text(why);
    EXPECT_EQ(why.subject, subject) << text(why);
    EXPECT_NEAR(why.value, value, 1e-4 * (1 + std::abs(value))) << text(why);
    EXPECT_NEAR(why.limit, limit, 1e-4 * (1 + std::abs(limit))) << text(why);
  }
  /// Operational, everything seen just now, nothing sent yet.
  void up() {
    ASSERT_TRUE(bring_to(Phase::kOperational)) << text(client.fault());
    all_live();
    step();
    ASSERT_TRUE(client.operational()) << text(client.fault());
    port.sent.clear();
  }
  /// Up anew: for the next of several ways to fail.
  void up_again() {
    for (int ms = 0; ms < 300; ++ms) {  // the nodes miss their controller, and say so to nobody
      now += 1ms;
      nodes.step(now, {});
      bus.advance(now);
      for (CanFrame frame; port.receive(frame);) {
      }
    }
    client.restart();
    ASSERT_EQ(client.phase(), Phase::kIdle);
    up();
  }
  std::vector<CanFrame> sent(std::uint32_t id) const {
    std::vector<CanFrame> found;
    for (const CanFrame& frame : port.sent) {
      if (frame.id == id) found.push_back(frame);
    }
    return found;
  }
  /// As a gate lets it pass; at most 0.35.
  PassedCommands passed(int joint, double value) const {
    JogState state;
    state.joint = joint;
    state.since = state.oldest_at = now;
    JointVector wanted = JointVector::Zero();
    wanted[joint] = value;
    const GateResult r = jog_gate(wanted, state, {wanted, now}, GateLimits(machine), now);
    EXPECT_EQ(r.commands, wanted) << text(r.fault);
    return r.commands;
  }

  MachineDescription machine = machine_with_exact_limits();
  VirtualCanBus bus{2, machine.bus.bit_rate};
  sim::CanNodes nodes{machine, {}, bus.port(1), 1};
  WatchedPort port{bus.port(0)};
  CanopenClient client{machine, port};
  Time now{1s};
};

TEST_F(BusSupervision, ANodeIsSilentBeyondItsTimeoutAndNotBefore) {
  for (const std::uint8_t silent : all()) {
    up_again();
    now += 250ms;
    all_live(silent);
    step();
    EXPECT_TRUE(client.operational()) << text(client.fault());
    now += 1ns;
    step();
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
    for (std::uint8_t id = kValve; id < kValve + 3; ++id) {
      if (id != old) status(id);
    }
    inputs();
    step();
    EXPECT_TRUE(client.operational()) << text(client.fault());
    now += 1ns;
    step();
    expect_fault(ReasonCode::kSensorStale, old, 39.0625, 39.0625);
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
  for (std::uint8_t id = kValve; id < kValve + 3; ++id) status(id);
  step();
  EXPECT_TRUE(client.operational()) << text(client.fault());
  now += 1ns;
  step();
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

TEST_F(BusSupervision, EachStateOfTheBusHasItsReason) {
  const std::pair<CanState, ReasonCode> states[] = {{CanState::kPassive, ReasonCode::kBusPassive},
                                                    {CanState::kBusOff, ReasonCode::kBusOff},
                                                    {CanState::kDown, ReasonCode::kBusDown},
                                                    {static_cast<CanState>(99), ReasonCode::kBusDown}};
  for (const auto& [state, code] : states) {
    up_again();
    port.state_now = state;
    step();
    expect_fault(code, 0, 0, 0);
    port.state_now = CanState::kActive;
  }
}

// ---- start-up

TEST_F(BusSupervision, StartUpWaitsForEveryBootMessageButNotForEver) {
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

TEST_F(BusSupervision, ANodeThatDoesNotStartIsNamedAfterASecond) {
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

TEST_F(BusSupervision, ARestartBelievesNothingFromBefore) {
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
  step(), step();
  for (const CanFrame& frame : sent(canopen::rpdo1_id(0x12)))
    EXPECT_EQ(canopen::parse_valve_command(frame)->control_word, canopen::kControlInit);
}

TEST_F(BusSupervision, ASetUpThatFailedIsForgottenByARestart) {
  const auto mute = [](CanFrame& frame) { return frame.id != canopen::sdo_response_id(0x22); };
  ASSERT_TRUE(bring_to(Phase::kFailed, mute));
  EXPECT_EQ(client.setup_failure().what, SetupFailure::What::kSilent);
  client.restart();
  EXPECT_EQ(client.setup_failure().what, SetupFailure::What::kNone);
}

TEST_F(BusSupervision, ANodeHasAnIdOfItsOwnBetween1And127) {
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

TEST_F(BusSupervision, AValveThatDoesNotBecomeActiveIsNamedAfterHalfASecond) {
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

TEST_F(BusSupervision, AnEnableNodeThatNeverSpeaksIsNamed) {
  const auto without_inputs = [](CanFrame& frame) { return frame.id != canopen::tpdo1_id(kEnableNode); };
  ASSERT_TRUE(bring_to(Phase::kFailed, without_inputs));
  EXPECT_EQ(client.fault().code, ReasonCode::kSensorStale) << text(client.fault());
  EXPECT_EQ(client.fault().subject, kEnableNode);
}

TEST_F(BusSupervision, AValveIsTakenToActiveStateByState) {
  // What the valve says, and what it is told next.
  const std::pair<std::uint16_t, std::uint16_t> steps[] = {
      {canopen::kStatusReady, canopen::kControlDisabled},
      {canopen::kControlDisabled | canopen::kStatusReady, canopen::kControlHold},
      {canopen::kControlHold | canopen::kStatusReady, canopen::kControlActive},
      {kWell, canopen::kControlActive},
      {canopen::kControlHold, canopen::kControlReset},  // in fault: an edge ...
      {canopen::kControlHold, canopen::kControlInit},   // ... that is made again if it did not help
      {canopen::kControlHold, canopen::kControlReset},
      {0x2 | canopen::kStatusReady, canopen::kControlInit}};  // no state of the profile
  const auto not_heard = [](CanFrame& frame) { return frame.id != canopen::tpdo1_id(0x12); };
  ASSERT_TRUE(bring_to(Phase::kActivating, not_heard)) << text(client.fault());
  const std::uint32_t to_valve = canopen::rpdo1_id(0x12);
  port.sent.clear();
  status(0x10), inputs();
  step(), step();
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
  status(0x11), status(0x12);
  step();
  EXPECT_TRUE(client.operational()) << text(client.fault());
}

// ---- what is sent

TEST_F(BusSupervision, SetPointsGoOutEverySecondSyncAndADropAtOnce) {
  up();
  const auto commands_of = [this](int joint) {
    return sent(canopen::rpdo1_id(static_cast<std::uint8_t>(kValve + joint))).size();
  };
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

TEST_F(BusSupervision, AFailedBusIsToldNeutralAndNoEnableWhateverIsAsked) {
  up();
  const PassedCommands open = passed(kBoom, 0.3);
  for (int i = 0; i < 2; ++i) step(open, true);
  client.receive(canopen::emergency_frame(0x24, {0x5030, 1, {}}), now);
  port.sent.clear();
  for (int i = 0; i < 20; ++i) step(open, true);
  ASSERT_EQ(client.phase(), Phase::kFailed);
  for (int i = 0; i < kJoints; ++i) {
    const auto commands = sent(canopen::rpdo1_id(static_cast<std::uint8_t>(kValve + i)));
    EXPECT_GE(commands.size(), 10U);
    for (const CanFrame& frame : commands) EXPECT_EQ(canopen::parse_valve_command(frame)->set_point, 0);
  }
  ASSERT_FALSE(sent(canopen::rpdo1_id(kEnableNode)).empty());
  for (const CanFrame& frame : sent(canopen::rpdo1_id(kEnableNode))) EXPECT_EQ(canopen::parse_enable(frame), 0);
}

TEST_F(BusSupervision, NothingButHeartbeatsAndSyncBeforeTheValvesAreTaken) {
  ASSERT_TRUE(bring_to(Phase::kStarting));
  for (int i = 0; i < kJoints; ++i) EXPECT_TRUE(sent(canopen::rpdo1_id(static_cast<std::uint8_t>(kValve + i))).empty());
  EXPECT_TRUE(sent(canopen::rpdo1_id(kEnableNode)).empty());
}

TEST_F(BusSupervision, TheControllersHeartbeatHasItsPeriod) {
  up();
  const std::uint32_t id = canopen::heartbeat_id(1);
  port.sent.clear();
  for (int i = 0; i < 1000 && sent(id).empty(); ++i) now += 100us, step();
  ASSERT_EQ(sent(id).size(), 1U);
  EXPECT_EQ(canopen::parse_heartbeat(sent(id).back()), canopen::NmtState::kOperational);
  port.sent.clear();
  now += 62400us;
  step();
  EXPECT_TRUE(sent(id).empty());
  now += 100us;  // a step a rounding early is in time
  now -= 1us;
  step();
  EXPECT_EQ(sent(id).size(), 1U);
  now += 62500us;
  step();
  EXPECT_EQ(sent(id).size(), 2U);
}

}  // namespace
}  // namespace knuckle::slave
