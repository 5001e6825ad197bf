// A machine that is led through its own controller by frames alone: no node is on its bus.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "machine/reason_text.h"
#include "machine/set_points.h"
#include "slave/orderly_stop.h"
#include "tests/slave/bench_machine.h"
#include "tests/support/command_machine.h"
#include "transport/virtual_can.h"

namespace knuckle::slave {
namespace {

constexpr std::uint32_t kFront = 0x18FF0105U | kExtendedId, kState = 0x18FF4021U | kExtendedId;

struct OwnBus : test::BenchMachine {
  explicit OwnBus(const std::string& commands = test::kRateCommands, const std::string& state = test::kStateBroadcast)
      : BenchMachine(calibrated(parse_machine(test::command_text(commands, state), "m.toml"))) {
    signals.shaft_rad = JointVector(0.3, -1.5, -0.8);
  }
  [[nodiscard]] std::string fault() const { return text_with_code(loop.fault(), description.bus); }
  [[nodiscard]] bool closed() const {
    return (signals.spool.array().abs() < description.cylinders[kBoom].valve.dead_band_extend).all();
  }
};

class OwnBusOf : public testing::TestWithParam<const char*> {};

TEST_P(OwnBusOf, FollowsTheHandAndStandsWithIt) {
  OwnBus m(GetParam());
  ASSERT_TRUE(m.engage()) << m.fault();
  const JointVector from = m.angles();
  m.move(JointVector(0.1, -0.1, 0.15), 2s);
  m.move(JointVector::Zero(), 1500ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << m.fault();
  const JointVector went = m.angles() - from, wanted(0.2, -0.2, 0.3);
  for (int i = 0; i < kJoints; ++i) EXPECT_NEAR(went[i], wanted[i], 0.04) << i;
}

TEST_P(OwnBusOf, NobodySendsWhatOnlyNodesNeed) {
  OwnBus m(GetParam());
  m.recording = true;
  ASSERT_TRUE(m.engage()) << m.fault();
  std::set<std::uint32_t> ids, known;
  for (const auto& sent : m.wire) ids.insert(sent.frame.id);
  for (const BroadcastFrame& frame : m.description.bus.broadcasts) known.insert(frame.id);
  for (const CommandFrame& frame : m.description.bus.commands) known.insert(frame.id);
  EXPECT_EQ(ids, known) << "no SYNC, no heartbeat, no NMT, no SDO";
}

TEST_P(OwnBusOf, StandsWhenItsControllerDies) {
  OwnBus m(GetParam());
  ASSERT_TRUE(m.engage()) << m.fault();
  m.move(JointVector(0.15, 0, 0), 1s);
  ASSERT_FALSE(m.closed());
  m.hung = true;
  // 50 ms of patience, and the spool's way home.
  m.run(50ms + 100ms);
  EXPECT_TRUE(m.closed());
  m.run(1s);
  EXPECT_TRUE(m.closed());
}

TEST_P(OwnBusOf, StopsByItsEStopAndDoesNotResume) {
  OwnBus m(GetParam());
  ASSERT_TRUE(m.engage()) << m.fault();
  m.move(JointVector(0.15, 0, 0), 500ms);
  m.nodes.set_estop(true);
  m.move(JointVector(0.15, 0, 0), 100ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEStop);
  EXPECT_EQ(m.loop.commands(), JointVector::Zero());
  m.nodes.set_estop(false);
  m.move(JointVector(0.15, 0, 0), 500ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEStop) << "enable is still held";
  EXPECT_TRUE(m.closed());
}

TEST_P(OwnBusOf, AStateThatStopsComingIsAFaultByName) {
  OwnBus m(GetParam());
  ASSERT_TRUE(m.engage()) << m.fault();
  m.can.lost = {kState};
  m.run(60ms);  // the newest was up to 25 ms old
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << "three of 25 ms may be lost";
  m.run(60ms);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_EQ(m.fault().rfind("sensor_stale: machine_state (0x18FF4021), e_stop_closed: ", 0), 0U) << m.fault();
}

TEST_P(OwnBusOf, AValveThatDoesNotMoveIsFoundByTheMotion) {
  OwnBus m(GetParam());
  ASSERT_TRUE(m.engage()) << m.fault();
  m.blocked[kArm] = true;
  m.move(JointVector(0, -0.3, 0), 2500ms);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_EQ(m.fault().rfind("motion_not_following: arm: does not move as it was told", 0), 0U) << m.fault();
  // Mended, and not before the operator has let go and pressed again.
  m.blocked[kArm] = false;
  m.run(1s);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_TRUE(m.engage()) << m.fault();
}

TEST_P(OwnBusOf, AValveThatStaysOpenIsFoundByTheMotion) {
  OwnBus m(GetParam());
  ASSERT_TRUE(m.engage()) << m.fault();
  m.jammed[kArm] = 0.5;
  m.run(1s);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_EQ(m.fault().rfind("motion_not_following: arm: ", 0), 0U) << m.fault();
}

TEST_P(OwnBusOf, AnotherSenderOfItsCommandsIsAFault) {
  OwnBus m(GetParam());
  ASSERT_TRUE(m.engage()) << m.fault();
  m.bus.port(2).send({.id = m.description.bus.commands.front().id, .size = 8, .data = {}});
  m.run(20ms);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_EQ(m.loop.fault().code, ReasonCode::kOtherController) << m.fault();
}

TEST_P(OwnBusOf, IsLeftNeutralByAnOrderlyStop) {
  OwnBus m(GetParam());
  ASSERT_TRUE(m.engage()) << m.fault();
  m.move(JointVector(0.15, 0, 0), 500ms);
  ASSERT_FALSE(m.closed());
  m.hung = true;
  m.run(2ms);  // what was sent before
  OrderlyStop stop(m.description, m.can);
  stop.go_on_from(m.loop.client().command_frames());
  m.recording = true;
  m.wire.clear();
  for (int i = 0; i < 200 && !stop.done(); ++i) {
    stop.step(m.now);
    m.run(5ms);
  }
  EXPECT_TRUE(stop.done());
  EXPECT_FALSE(stop.unconfirmed_pilot());
  EXPECT_TRUE(m.closed());
  int told = 0;
  for (const auto& sent : m.wire) {
    for (int joint = 0; joint < kJoints; ++joint) {
      const auto set_point = set_point_in(sent.frame, joint, m.description.bus);
      told += set_point ? 1 : 0;
      EXPECT_EQ(set_point.value_or(0), 0);
    }
  }
  EXPECT_GT(told, 0);
}

const char* kind_name(const testing::TestParamInfo<const char*>& kind) {
  return kind.index == 0 ? "JointRate" : kind.index == 1 ? "PilotPressure" : "Flow";
}
INSTANTIATE_TEST_SUITE_P(Kinds, OwnBusOf,
                         testing::Values(test::kRateCommands, test::kPilotCommands, test::kFlowCommands), kind_name);

TEST(OwnBus, WithoutAStateIsLedAsWell) {
  OwnBus m(test::kRateCommands, "");
  ASSERT_TRUE(m.engage()) << m.fault();
  m.move(JointVector(0.1, 0, 0), 500ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << m.fault();
}

TEST(OwnBus, AnOrderlyStopBelievesNoFrameThatIsDamagedOrHasNoValueThatPilotPressureIsOff) {
  const std::string state = R"([[bus.broadcast]]
name = "machine_state"
id = 0x18FF4021
bytes = 2
period_ms = 25
checksum = { kind = "sum", start = 8, bits = 8 }
[bus.broadcast.signals]
pilot_on = { start = 0, bits = 2, invalid_from = 2 }
)";
  const MachineDescription machine = parse_machine(test::command_text(test::kRateCommands, state), "m.toml");
  const auto told = machine.bus.broadcast(NodeRole::kEnable, kPilotOnIndex);
  struct {
    const char* what;
    std::uint64_t raw;
    bool damaged, off;
  } const cases[] = {
      {"off", 0, false, true}, {"on", 1, false, false}, {"no value", 2, false, false}, {"damaged", 0, true, false}};
  for (const auto& c : cases) {
    VirtualCanBus bus(2, machine.bus.bit_rate);
    OrderlyStop stop(machine, bus.port(0));
    CanFrame frame{.id = told.frame->id, .size = told.frame->bytes, .data = {}};
    write_raw(told.field->bits, c.raw, frame);
    close_frame(told.frame->closing, 0, frame);
    if (c.damaged) ++frame.data[1];
    for (Time now{}; now < Time(2s) && !stop.done(); now += 5ms) {
      bus.port(1).send(frame);
      bus.advance(now);
      stop.step(now);
    }
    EXPECT_TRUE(stop.done()) << c.what;
    EXPECT_NE(stop.unconfirmed_pilot(), c.off) << c.what;
  }
}

}  // namespace
}  // namespace knuckle::slave
