// Who else speaks on the bus: a second controller, foreign senders, and node ids that stand for two devices.
#include "slave/bus_watch.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/slave/leading.h"
#include "tests/support/no_alloc.h"
#include "tests/support/sensor_frames.h"

namespace knuckle::slave {
namespace {

using canopen::NmtCommand;
using canopen::NmtState;
using test::BenchMachine;
using test::LedMachine;

CanBus& stranger(BenchMachine& m) {
  return m.bus.port(2);
}

bool moves(const CanFrame& frame) {
  const bool valve = canopen::function_of(frame.id) == canopen::rpdo1_id(0) && frame.size == 4;
  const auto command = canopen::parse_valve_command(frame);
  return valve && command && command->set_point != 0;
}

bool neutral_by(const BenchMachine& m, Duration since_clear) {
  const Time from = m.now - since_clear;
  return std::none_of(m.wire.begin(), m.wire.end(), [&](const auto& w) { return w.at > from && moves(w.frame); });
}

struct ForeignFrame {
  const char* what;
  CanFrame frame;
  ReasonCode code;
  std::uint8_t node;
};

const std::vector<ForeignFrame>& foreign_frames() {
  static const std::vector<ForeignFrame> frames{
      {"SYNC", canopen::sync_frame(), ReasonCode::kOtherController, 0},
      {"its heartbeat", canopen::heartbeat_frame(1, NmtState::kOperational), ReasonCode::kOtherController, 0},
      {"NMT of one node", canopen::nmt_frame(NmtCommand::kStart, 0x38), ReasonCode::kOtherController, 0},
      {"set-point", canopen::valve_command_frame(0x211, {canopen::kControlActive, 0}), ReasonCode::kForeignSender,
       0x11},
      {"enable output", canopen::enable_output_frame(0x240, canopen::kOutputEnable), ReasonCode::kForeignSender, 0x40},
      {"SDO write", canopen::sdo_download(0x22, canopen::kProducerHeartbeat, 50, 2), ReasonCode::kForeignSender, 0x22},
      {"SDO command of no known kind", {.id = 0x622, .size = 8, .data = {0xE0}}, ReasonCode::kForeignSender, 0x22},
      {"SDO write in segments", {.id = 0x622, .size = 8, .data = {0x00}}, ReasonCode::kForeignSender, 0x22},
      {"empty SDO request", {.id = 0x622, .size = 0, .data = {}}, ReasonCode::kForeignSender, 0x22}};
  return frames;
}

TEST(ForeignSender, OneFrameThatOnlyTheControllerSendsEndsTheMotionAndSaysWhat) {
  for (const auto& [what, frame, code, node] : foreign_frames()) {
    LedMachine m;
    stranger(m).send(frame);
    m.run(15ms);
    EXPECT_EQ(m.loop.mode(), Mode::kFault) << what;
    EXPECT_TRUE(test::is(m.loop.fault(), code, node)) << what;
    EXPECT_EQ(m.loop.fault().value, static_cast<float>(frame.id)) << what;
    m.run(100ms);
    EXPECT_TRUE(neutral_by(m, 90ms)) << what;
    EXPECT_FALSE(m.nodes.outputs().pilot) << what;
  }
}

TEST(ForeignSender, MayReadWhileTheMachineRuns) {
  LedMachine m;
  for (const std::uint8_t command :
       std::initializer_list<std::uint8_t>{0x40, 0x60, 0x70, 0x80, 0xA0})  // upload, its segments, abort, block upload
    stranger(m).send({.id = 0x622, .size = 8, .data = {command, 0x00, 0x10, 0x00}});
  m.run(50ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << text(m.loop.fault());
  EXPECT_EQ(m.loop.client().watch().foreign_reads(), 5U);
  EXPECT_EQ(m.loop.client().watch().last_read_node(), 0x22);
}

TEST(ForeignSender, IsAReasonUntilItWasQuietForASecondAndTheOperatorAsksAnew) {
  LedMachine m;
  m.hand.enable = false;
  for (int i = 0; i < 30; ++i) {
    stranger(m).send(canopen::valve_command_frame(0x210, {}));
    m.run(100ms);
  }
  EXPECT_TRUE(test::is(m.loop.fault(), ReasonCode::kForeignSender));
  EXPECT_TRUE(test::is(m.loop.blocking(), ReasonCode::kForeignSender));
  m.run(4s);
  EXPECT_NE(m.loop.blocking().code, ReasonCode::kForeignSender) << text(m.loop.blocking());
  EXPECT_TRUE(m.engage()) << text(m.loop.blocking());
}

TEST(ForeignSender, HidesNoOpenEStopHoweverLongItIsHeard) {
  LedMachine m;
  m.hand.enable = false;
  m.nodes.set_estop(true);
  m.run(500ms);
  for (int i = 0; i < 4000; ++i) {
    if (i % 100 == 0) stranger(m).send(canopen::valve_command_frame(0x210, {}));
    m.tick();
    ASSERT_TRUE(test::is(m.loop.blocking(), ReasonCode::kEmergencyStop)) << i << " ms";
  }
}

TEST(ForeignSender, TheFirstOfSeveralIsNamedAndAControllerBeforeAll) {
  BusWatch watch(test::test_machine().bus);
  const Time now{10s};
  watch.receive(canopen::valve_command_frame(0x211, {}), now);
  watch.receive(canopen::valve_command_frame(0x210, {}), now);
  EXPECT_EQ(watch.foreign(now + BusWatch::kStands).subject, 0x11);
  EXPECT_FALSE(watch.foreign(now + BusWatch::kStands + 1ns));
  watch.receive(canopen::nmt_frame(NmtCommand::kResetNode, 0), now);
  watch.receive(canopen::sync_frame(), now + 900ms);
  EXPECT_TRUE(test::is(watch.foreign(now + 1800ms), ReasonCode::kOtherController));
  EXPECT_EQ(watch.foreign(now + 1800ms).value, 0.F);
  watch.receive(canopen::sync_frame(), now + 2s);
  EXPECT_EQ(watch.foreign(now + 2s).value, 128.F) << "another time, another first frame";
}

TEST(OtherController, IsLeftAloneByWhoComesSecond) {
  BenchMachine m;
  std::size_t sent = 0;
  for (int i = 0; i < 400; ++i) {  // a machine led by somebody else: SYNC every 5 ms
    if (i % 5 == 0) {
      stranger(m).send(canopen::sync_frame());
      ++sent;
    }
    m.tick();
  }
  EXPECT_TRUE(test::is(m.loop.fault(), ReasonCode::kOtherController));
  EXPECT_EQ(m.frames(canopen::kNmtId).size(), 0U);
  EXPECT_EQ(m.frames(canopen::kSyncId).size(), sent) << "not one of ours";
  EXPECT_TRUE(m.frames(0x701).empty());
  EXPECT_TRUE(m.frames(0x210).empty());
  m.run(4s);
  EXPECT_TRUE(m.engage()) << text(m.loop.blocking());
}

TEST(OtherController, TwoThatStartTogetherAreBothNeutralAndResetNobodyAgain) {
  BenchMachine m;
  test::ScriptedLink link;
  SlaveLoop second(m.description, stranger(m), link, {12, 1h});
  m.hand.presence = true;
  for (int i = 0; i < 5000; ++i) {
    m.tick();
    if (m.ticks % 5 == 0) second.step(m.now);
  }
  EXPECT_TRUE(test::is(m.loop.blocking(), ReasonCode::kOtherController));
  EXPECT_TRUE(test::is(second.blocking(), ReasonCode::kOtherController));
  EXPECT_LE(m.frames(canopen::kNmtId).size(), 4U) << "of one step of each, before they could hear each other";
  for (const CanFrame& frame : m.frames(canopen::kNmtId))
    EXPECT_EQ(canopen::parse_nmt(frame)->command, canopen::NmtCommand::kEnterPreOperational);
  EXPECT_FALSE(m.nodes.outputs().pilot);
  EXPECT_TRUE(std::none_of(m.wire.begin(), m.wire.end(), [](const auto& w) { return moves(w.frame); }));
}

/// As fast as anybody reads.
class Flood final : public CanBus {
 public:
  explicit Flood(CanBus& bus) noexcept : bus_(bus) {}
  bool send(const CanFrame& frame) noexcept override { return bus_.send(frame); }
  bool receive(CanFrame& frame) noexcept override {
    ++reads;
    if (!on) return bus_.receive(frame);
    frame = flooding;
    return true;
  }
  [[nodiscard]] CanState state() const noexcept override { return bus_.state(); }
  CanFrame flooding;
  bool on = false;
  int reads = 0;

 private:
  CanBus& bus_;
};

TEST(ForeignSender, AFloodUnderOurIdentifiersIsBoundedWorkAStep) {
  std::vector<CanFrame> floods{canopen::sdo_upload(0x10, canopen::kDeviceType),
                               canopen::sdo_uploaded(0x10, {}, 0, 4),
                               canopen::heartbeat_frame(0x10, NmtState::kOperational),
                               {.id = 0x1A0}};
  for (const ForeignFrame& one : foreign_frames()) floods.push_back(one.frame);
  for (const CanFrame& flooding : floods) {
    BenchMachine m;
    Flood port(m.bus.port(0));
    port.flooding = flooding;
    test::ScriptedLink link;
    SlaveLoop loop(m.description, port, link, {11, 1h});
    m.hung = true;
    for (const bool on : {false, true}) {
      port.on = on;
      for (int i = 0; i < 500; ++i) {
        m.tick();
        if (i % 5 != 0) continue;
        port.reads = 0;
        const test::NoAllocScope none;
        loop.step(m.now);
        const std::uint64_t allocated = none.allocations();
        ASSERT_EQ(allocated, 0U);
        ASSERT_LE(port.reads, kMostFramesPerStep) << std::hex << flooding.id;
      }
    }
    EXPECT_NE(loop.mode(), Mode::kReady) << std::hex << flooding.id;
  }
}

/// Of all that nodes send, one node's alone reaches the bus: a second device with its id.
class OneNode final : public CanBus {
 public:
  OneNode(CanBus& bus, std::uint8_t node) noexcept : bus_(bus), node_(node) {}
  bool send(const CanFrame& frame) noexcept override { return canopen::node_of(frame.id) != node_ || bus_.send(frame); }
  bool receive(CanFrame& frame) noexcept override { return bus_.receive(frame); }
  [[nodiscard]] CanState state() const noexcept override { return bus_.state(); }

 private:
  CanBus& bus_;
  std::uint8_t node_;
};

/// A second device of a node's id, whole or nothing but what a test lets it send.
struct Twin {
  Twin(BenchMachine& bench, std::uint8_t node)
      : m(bench), port(stranger(bench), node), nodes(bench.description, {}, port, 2) {}
  void run(Duration time) {
    for (const Time end = m.now + time; m.now < end;) {
      nodes.step(m.now + 1ms, m.signals);
      m.tick();
    }
  }
  BenchMachine& m;
  OneNode port;
  sim::CanNodes nodes;
};

TEST(NodeIdTwice, TwoDevicesThatDoAllTheSameAreFoundBeforeAnythingMovesAndNamed) {
  for (const int id : {0x10, 0x12, 0x22, 0x31, 0x38, 0x40}) {
    BenchMachine m;
    const auto node = static_cast<std::uint8_t>(id);
    Twin twin(m, node);
    m.hand.presence = true;
    twin.run(4s);
    EXPECT_TRUE(test::is(m.loop.blocking(), ReasonCode::kNodeIdTwice, node)) << id;
    EXPECT_FALSE(m.nodes.outputs().pilot);
  }
}

/// What joins the bus of a machine that is led: frames of a node's id from elsewhere, so many a second.
Reason joined(const CanFrame& frame, double per_s, Duration most = 10s) {
  LedMachine m;
  m.hand.velocity_radps.setZero();
  m.recording = false;
  double due = 0;
  for (const Time end = m.now + most; m.now < end && m.loop.mode() == Mode::kEngaged;) {
    for (due += 1e-3 * per_s; due >= 1; --due) stranger(m).send(frame);
    m.tick();
  }
  return m.loop.fault();
}

TEST(NodeIdTwice, TooManyFramesUnderOneIdentifierAreAFaultByThemselves) {
  const auto bar = [](double value) { return canopen::pressure_frame(0x1A2, {value * 1e5, 0}); };
  const BenchMachine bench;
  const std::pair<CanFrame, double> joining[] = {
      {bar(20), 200},
      {bar(20), 20},  // a tenth as often as the right one
      {canopen::heartbeat_frame(0x22, NmtState::kOperational), 10},
      {canopen::enable_inputs_frame(0x1C0, canopen::kInputEStopClosed | canopen::kInputPilotOn), 20},
      {canopen::valve_status_frame(0x192, {canopen::kControlActive | canopen::kStatusReady, 0}), 50}};
  for (const auto& [frame, per_s] : joining) {
    const Reason why = joined(frame, per_s);
    EXPECT_TRUE(test::is(why, ReasonCode::kNodeIdTwice, canopen::node_of(frame.id))) << std::hex << frame.id;
    EXPECT_GT(why.value, why.limit);
  }
}

TEST(NodeIdTwice, IsNoFaultOfAHealthyBus) {
  // Clocks of the nodes are a little fast, errors on the bus make single frames arrive twice, a contact bounces.
  const std::pair<CanFrame, double> healthy[] = {
      {canopen::heartbeat_frame(0x22, NmtState::kOperational), 0.3},
      {canopen::pressure_frame(0x1A2, {20e5, 0}), 3},
      {canopen::enable_inputs_frame(0x1C0, canopen::kInputEStopClosed | canopen::kInputPilotOn), 0.9}};
  for (const auto& [frame, per_s] : healthy) {
    const Reason why = joined(frame, per_s, 60s);
    EXPECT_FALSE(why) << std::hex << frame.id << ": " << text(why);
  }
  LedMachine m;
  m.hand.velocity_radps.setZero();
  for (int i = 0; i < 20; ++i)
    stranger(m).send(canopen::enable_inputs_frame(0x1C0, canopen::kInputEStopClosed | canopen::kInputPilotOn));
  m.run(1s);
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << text(m.loop.fault());
}

/// That all nodes are operational and counted.
struct Counting : BusWatch {
  explicit Counting(const BusDescription& bus = test::test_machine().bus) : BusWatch(bus) { count_frames(true); }
};

TEST(NodeIdTwice, IsFoundAsSoonAfterAHealthyHourAsAtOnce) {
  Counting watch;
  const CanFrame pressure = canopen::pressure_frame(0x1A2, {20e5, 0});
  for (int i = 0; i < 3600 * 200; ++i) {
    watch.synced();
    watch.receive(pressure, Time{1s});
  }
  ASSERT_FALSE(watch.twice());
  int syncs = 0;
  for (; !watch.twice() && syncs < 100; ++syncs) {
    watch.synced();
    for (int k = 0; k < 2; ++k) watch.receive(pressure, Time{1s});
  }
  EXPECT_LT(syncs, 15);
}

TEST(NodeIdTwice, WhatMayBeHeldUpForAsLongAsAFileLetsASensorsValueAgeIsNoSign) {
  BusDescription bus = test::test_machine().bus;
  bus.sensor_age_limit_s = 0.2;
  const int held_up = static_cast<int>(bus.sensor_age_limit_s * bus.sync_Hz);
  Counting watch(bus);
  watch.note_second_answers(0x22, 1);
  for (int i = 0; i < held_up; ++i) watch.synced();
  for (int i = 0; i < held_up; ++i) watch.receive(canopen::pressure_frame(0x1A2, {20e5, 0}), Time{1s});
  EXPECT_FALSE(watch.twice()) << text(watch.twice());
}

TEST(NodeIdTwice, InputsThatChangeAgainAndAgainForMinutesAreOneNodes) {
  Counting watch;
  std::uint8_t inputs = canopen::kInputEStopClosed;
  for (int i = 0; i < 5 * 60 * 100; ++i) {
    const Time now{i * 10ms};
    watch.step(now);
    const bool bounces = i % 200 < 5;  // five changes, every two seconds
    if (bounces) inputs ^= canopen::kInputPilotOn;
    if (bounces || i % 5 == 0) watch.receive(canopen::enable_inputs_frame(0x1C0, inputs), now);
    ASSERT_FALSE(watch.twice()) << text(watch.twice()) << " after " << to_seconds(now) << " s";
  }
}

TEST(NodeIdTwice, OneSignAloneIsNoFaultAndTwoAre) {
  const CanFrame pressure = canopen::pressure_frame(0x1A2, {20e5, 0});
  const CanFrame heartbeat = canopen::heartbeat_frame(0x22, NmtState::kOperational);
  const auto many = [](BusWatch& watch, const CanFrame& frame, int times) {
    for (int i = 0; i < times; ++i) watch.receive(frame, Time{1s});
  };
  constexpr int kHalf = static_cast<int>(BusWatch::kMostOver / 2) + 1, kAll = static_cast<int>(BusWatch::kMostOver) + 1;
  struct Story {
    int pressures, heartbeats, answers;
    bool fault;
  };
  for (const Story& s :
       {Story{kHalf, 0, 0, false}, Story{kAll, 0, 0, true}, Story{0, kHalf, 0, false}, Story{kHalf, kHalf, 0, true},
        Story{0, 0, 1, false}, Story{0, 0, 2, true}, Story{kHalf, 0, 1, true}, Story{kHalf - 1, 0, 1, false}}) {
    Counting watch;
    many(watch, pressure, s.pressures);
    many(watch, heartbeat, s.heartbeats);
    watch.note_second_answers(0x22, s.answers);
    const Reason why = watch.twice();
    EXPECT_TRUE(test::is(why, s.fault ? ReasonCode::kNodeIdTwice : ReasonCode::kNone))
        << s.pressures << ' ' << s.heartbeats << ' ' << s.answers;
    EXPECT_EQ(why.subject, s.fault ? 0x22 : 0);
    watch.restart();
    EXPECT_FALSE(watch.twice()) << "forgotten with the next start";
  }
}

TEST(NodeIdTwice, ForeignSyncExplainsTheAnswersToIt) {
  Counting watch;
  for (int i = 0; i < 100; ++i) {
    watch.synced();
    watch.receive(canopen::sync_frame(), Time{1s});
    for (int k = 0; k < 2; ++k) watch.receive(canopen::pressure_frame(0x1A2, {}), Time{1s});
  }
  EXPECT_FALSE(watch.twice());
}

}  // namespace
}  // namespace knuckle::slave
