// Machines that are led by frames alone, of every kind that a file may have: commands to the machine's own controller,
// auxiliary valves of ISO 11783-7, outputs of a module.
#include <gtest/gtest.h>

#include <set>
#include <string>

#include "machine/set_points.h"
#include "slave/orderly_stop.h"
#include "tests/slave/leading.h"
#include "tests/support/j1939_machine.h"
#include "tests/support/module_machine.h"
#include "tests/support/says.h"
#include "transport/virtual_can.h"

namespace knuckle::slave {
namespace {

struct CommandedMachine {
  const char* name;
  MachineDescription (*description)();
};
constexpr CommandedMachine kByRates{"JointRate", [] { return test::command_machine(); }},
    kByPilots{"PilotPressure", [] { return test::command_machine(test::kPilotCommands); }},
    kByFlows{"Flow", [] { return test::command_machine(test::kFlowCommands); }},
    kByValves{"AuxiliaryValves", test::valves_machine},
    kByVoltages{"HalfTheSupply", [] { return test::module_machine(); }},
    kByCurrents{"MagnetEachWay", [] { return test::module_machine(test::kCurrentOutputs); }};

class LedByFrames : public testing::TestWithParam<CommandedMachine> {
 protected:
  /// Engaged, and moving.
  void lead_boom(Duration time = 1s) {
    ASSERT_TRUE(m.engage()) << m.fault();
    m.move(JointVector(0.15, 0, 0), time);
    ASSERT_FALSE(m.closed());
  }
  test::BenchMachine m{GetParam().description()};
};
using WithoutNodes = LedByFrames;
using LedByAModule = LedByFrames;

std::string machine_name(const testing::TestParamInfo<CommandedMachine>& machine) {
  return machine.param.name;
}
INSTANTIATE_TEST_SUITE_P(Kinds, LedByFrames,
                         testing::Values(kByRates, kByPilots, kByFlows, kByValves, kByVoltages, kByCurrents),
                         machine_name);

TEST_P(LedByFrames, FollowsTheHandAndStandsWithIt) {
  ASSERT_TRUE(m.engage()) << m.fault();
  const JointVector from = m.angles();
  m.move(JointVector(0.1, -0.1, 0.15), 2s);
  m.move(JointVector::Zero(), 1500ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << m.fault();
  const JointVector went = m.angles() - from, wanted(0.2, -0.2, 0.3);
  for (int i = 0; i < kJoints; ++i) EXPECT_NEAR(went[i], wanted[i], 0.04) << i;
}

TEST_P(LedByFrames, StandsWhenItsControllerDies) {
  ASSERT_NO_FATAL_FAILURE(lead_boom());
  m.hung = true;
  // 50 ms of patience, and the spool's way home.
  m.run(50ms + 100ms);
  EXPECT_TRUE(m.closed());
  EXPECT_EQ(m.nodes.outputs().spool_demand, JointVector::Zero());
  m.run(1s);
  EXPECT_TRUE(m.closed());
  if (!m.description.bus.has_enable()) return;
  EXPECT_FALSE(m.nodes.outputs().pilot) << "the enable node has missed the heartbeat";
}

TEST_P(LedByFrames, StopsByItsEStopAndDoesNotResume) {
  ASSERT_NO_FATAL_FAILURE(lead_boom(500ms));
  m.nodes.set_estop(true);
  m.move(JointVector(0.15, 0, 0), 100ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEStop);
  EXPECT_EQ(m.loop.commands(), JointVector::Zero());
  m.nodes.set_estop(false);
  m.move(JointVector(0.15, 0, 0), 500ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEStop) << "enable is still held";
  EXPECT_TRUE(m.closed());
}

TEST_P(LedByFrames, AValveThatDoesNotMoveIsFoundByTheMotion) {
  ASSERT_TRUE(m.engage()) << m.fault();
  m.blocked[kArm] = true;
  m.move(JointVector(0, -0.3, 0), 2500ms);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_TRUE(test::begins(m.fault(), "motion_not_following: arm: does not move as it was told"));
  // Mended, and not before the operator has let go and pressed again.
  m.blocked[kArm] = false;
  m.run(1s);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_TRUE(m.engage()) << m.fault();
}

TEST_P(LedByFrames, IsLeftNeutralByAnOrderlyStop) {
  ASSERT_NO_FATAL_FAILURE(lead_boom(500ms));
  m.hung = true;
  m.run(2ms);  // what was sent before
  OrderlyStop stop(m.description, m.can);
  stop.go_on_from(m.loop.client().command_frames());
  m.wire.clear();
  test::take_out_of_service(m, stop);
  m.run(500ms);
  EXPECT_FALSE(stop.unconfirmed_pilot());
  EXPECT_TRUE(m.closed());
  EXPECT_EQ(m.nodes.outputs().spool_demand, JointVector::Zero());
  for (const NodeDescription& node : m.description.bus.nodes) EXPECT_FALSE(m.nodes.node(node.id)->operational());
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

// No node is on its bus.

INSTANTIATE_TEST_SUITE_P(Kinds, WithoutNodes, testing::Values(kByRates, kByPilots, kByFlows), machine_name);

TEST_P(WithoutNodes, NobodySendsWhatOnlyNodesNeed) {
  ASSERT_TRUE(m.engage()) << m.fault();
  std::set<std::uint32_t> ids, known;
  for (const auto& sent : m.wire) ids.insert(sent.frame.id);
  for (const BroadcastFrame& frame : m.description.bus.broadcasts) known.insert(frame.id);
  for (const CommandFrame& frame : m.description.bus.commands) known.insert(frame.id);
  EXPECT_EQ(ids, known) << "no SYNC, no heartbeat, no NMT, no SDO";
}

TEST_P(WithoutNodes, AStateThatStopsComingIsAFaultByName) {
  ASSERT_TRUE(m.engage()) << m.fault();
  m.can.lost = {0x18FF4021U | kExtendedId};
  m.run(60ms);  // the newest was up to 25 ms old
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << "three of 25 ms may be lost";
  m.run(60ms);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_TRUE(test::begins(m.fault(), "sensor_stale: machine_state (0x18FF4021), e_stop_closed: "));
}

TEST(WithoutAState, AMachineIsLedAsWell) {
  test::BenchMachine m(parse_machine(test::command_text(test::kRateCommands, ""), "m.toml"));
  ASSERT_TRUE(m.engage()) << m.fault();
  m.move(JointVector(0.1, 0, 0), 500ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << m.fault();
}

TEST(LedByFramesAlone, AnOrderlyStopBelievesNoFrameThatIsDamagedOrHasNoValueThatPilotPressureIsOff) {
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

// Its valves hang on a module of CiA 401.

constexpr std::uint8_t kTheModule = 0x41;
INSTANTIATE_TEST_SUITE_P(Kinds, LedByAModule, testing::Values(kByVoltages, kByCurrents), machine_name);

TEST_P(LedByAModule, ThatIsOffTheBusIsNeutralAndAFault) {
  ASSERT_NO_FATAL_FAILURE(lead_boom());
  m.nodes.inject(kTheModule, sim::NodeFault::kSilent);
  m.run(200ms);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_TRUE(test::begins(m.fault(), "sensor_stale: module (node 0x41): "));
  EXPECT_EQ(m.nodes.outputs().spool_demand, JointVector::Zero());
  EXPECT_TRUE(m.closed());
  // Its cable is mended: nothing moves before the operator has let go and pressed again.
  m.nodes.inject(kTheModule, sim::NodeFault::kNone);
  m.run(2s);
  EXPECT_EQ(m.nodes.outputs().spool_demand, JointVector::Zero());
  EXPECT_TRUE(m.engage()) << m.fault();
}

TEST_P(LedByAModule, ThatStartsAnewIsNeutralAndAFault) {
  ASSERT_NO_FATAL_FAILURE(lead_boom());
  m.bus.port(2).send(canopen::nmt_frame(canopen::NmtCommand::kResetNode, kTheModule));
  m.move(JointVector(0.15, 0, 0), 100ms);
  EXPECT_EQ(m.loop.mode(), Mode::kFault) << m.fault();
  EXPECT_EQ(m.nodes.outputs().spool_demand, JointVector::Zero());
}

TEST(AuxiliaryValves, HaveOneCommanderWhateverItsPriorityAndAddress) {
  test::BenchMachine m(test::valves_machine());
  ASSERT_TRUE(m.engage()) << m.fault();
  (void)m.bus.port(2).send({0x18FE3F80U | kExtendedId, 8, {0, 0xFF, 0x30, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}});
  m.run(10ms);
  EXPECT_TRUE(m.faulted(ReasonCode::kOtherController));
}

}  // namespace
}  // namespace knuckle::slave
