// How a machine is taken out of service, on a bus that loses what the test says.
#include "slave/orderly_stop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <random>
#include <vector>

#include "tests/slave/leading.h"
#include "tests/support/bus_nodes.h"
#include "tests/support/no_alloc.h"
#include "transport/canopen.h"

namespace knuckle::slave {
namespace {

using test::BenchMachine;

constexpr Duration kPeriod = 5ms;  // what was queued before the stop has left by then

const BusDescription& wires() {
  static const MachineDescription machine = test::test_machine();
  return machine.bus;
}

/// An engaged machine in motion, taken out of service.
struct Stopped {
  explicit Stopped(std::vector<std::uint32_t> lost = {}) {
    EXPECT_TRUE(bench.engage()) << text(bench.loop.blocking());
    bench.move(JointVector(0.25, -0.25, -0.3), 400ms);
    moving = bench.nodes.outputs().pilot && bench.loop.commands().cwiseAbs().minCoeff() > 0.12;
    bench.wire.clear();
    bench.can.lost = std::move(lost);
    since = bench.now;
    test::take_out_of_service(bench, stop);
  }
  [[nodiscard]] std::uint32_t value(std::uint8_t node, canopen::Object object) {
    return bench.nodes.node(node)->value(object);
  }
  [[nodiscard]] auto count(std::uint32_t id) const {
    return std::count_if(bench.wire.begin(), bench.wire.end(), [id](const auto& w) { return w.frame.id == id; });
  }
  /// Every node that can move something goes on watching, in the state in which both of its watchdogs count.
  void expect_watched() {
    EXPECT_EQ(count(canopen::kNmtId), 0);
    for (const NodeDescription& valve : test::nodes_with(wires(), NodeRole::kValve)) {
      EXPECT_NE(value(valve.id, canopen::kConsumerHeartbeat), 0U) << int{valve.id};
      EXPECT_NE(value(valve.id, canopen::kRpdo1Timer), 0U) << int{valve.id};
      EXPECT_TRUE(bench.nodes.node(valve.id)->operational()) << int{valve.id};
    }
    const std::uint8_t enable = wires().enable().id;
    EXPECT_NE(value(enable, canopen::kConsumerHeartbeat), 0U);
    EXPECT_TRUE(bench.nodes.node(enable)->operational());
  }

  BenchMachine bench;
  OrderlyStop stop{bench.description, bench.can};
  bool moving = false;
  Time since{};
};

TEST(OrderlyStop, AllocatesNothing) {
  BenchMachine bench;
  ASSERT_TRUE(bench.engage());
  bench.hung = true;
  bench.recording = false;
  OrderlyStop stop(bench.description, bench.bus.port(0));
  const test::NoAllocScope scope;
  while (!stop.done()) {
    stop.step(bench.now);
    bench.run(5ms);
  }
  EXPECT_EQ(scope.allocations(), 0U);
}

TEST(OrderlyStop, CommandsNeutralInItsFirstStepAndNodesThatAllSaidThatTheyAreOffMissNobodyAfterwards) {
  Stopped machine;
  ASSERT_TRUE(machine.moving);
  for (int i = 0; i < kJoints; ++i) {
    EXPECT_LE(machine.bench.command_neutral_since(machine.since, i), machine.since + kPeriod) << i;
  }
  EXPECT_EQ(machine.stop.unconfirmed_valves(), (PerJoint<bool>{}));
  EXPECT_FALSE(machine.stop.unconfirmed_pilot());
  machine.bench.run(500ms);
  EXPECT_EQ(machine.count(canopen::kNmtId), 14) << "each node of the machine, and no other";
  for (const NodeDescription& valve : test::nodes_with(wires(), NodeRole::kValve)) {
    EXPECT_EQ(machine.value(valve.id, canopen::kConsumerHeartbeat), 0U);
    EXPECT_EQ(machine.count(canopen::emcy_id(valve.id)), 0);
  }
  EXPECT_EQ(machine.value(wires().enable().id, canopen::kConsumerHeartbeat), 0U);
  EXPECT_EQ(machine.count(canopen::emcy_id(wires().enable().id)), 0);
  EXPECT_FALSE(machine.bench.nodes.outputs().pilot);
}

TEST(OrderlyStop, ResetsNoNodeThatAnotherControllerMayLead) {
  BenchMachine bench;
  ASSERT_TRUE(bench.engage()) << text(bench.loop.blocking());
  bench.wire.clear();
  bench.bus.port(2).send(canopen::sync_frame());
  OrderlyStop stop(bench.description, bench.can);
  test::take_out_of_service(bench, stop);
  EXPECT_EQ(stop.unconfirmed_valves(), (PerJoint<bool>{}));
  EXPECT_TRUE(bench.frames(canopen::kNmtId).empty());
}

TEST(OrderlyStop, AnEnableNodeThatMissedItsOutputKeepsItsWatchdogAndDropsPilotPressureByIt) {
  const NodeDescription& enable = wires().enable();
  Stopped machine({enable.rpdo_id()});
  ASSERT_TRUE(machine.moving);
  EXPECT_TRUE(machine.stop.unconfirmed_pilot());
  machine.expect_watched();
  EXPECT_TRUE(machine.bench.nodes.outputs().pilot) << "nothing has told it otherwise yet";
  machine.bench.run(300ms);
  EXPECT_FALSE(machine.bench.nodes.outputs().pilot);
  EXPECT_GT(machine.count(canopen::emcy_id(enable.id)), 0) << "by its own watchdog";
}

TEST(OrderlyStop, AValveThatIsNotReachedKeepsItsWatchdogsAndGoesNeutralByThem) {
  const NodeDescription& boom = wires().valve(kBoom);
  Stopped machine({boom.rpdo_id(), boom.tpdo_id()});
  ASSERT_TRUE(machine.moving);
  EXPECT_TRUE(machine.stop.unconfirmed_valves()[kBoom]);
  EXPECT_FALSE(machine.stop.unconfirmed_valves()[kArm]);
  machine.expect_watched();
  machine.bench.run(300ms);
  EXPECT_EQ(machine.bench.nodes.outputs().spool_demand, JointVector::Zero());
  EXPECT_GT(machine.count(canopen::emcy_id(boom.id)), 0) << "by its own watchdog";
}

TEST(OrderlyStop, WhoseAnswerGotLostIsNotBelievedToBeOff) {
  const BusDescription& bus = wires();
  for (const std::uint32_t lost : {bus.enable().tpdo_id(), bus.valve(kArm).tpdo_id()}) {
    Stopped machine({lost});
    ASSERT_TRUE(machine.moving);
    EXPECT_EQ(machine.stop.unconfirmed_pilot(), lost == bus.enable().tpdo_id());
    EXPECT_EQ(machine.stop.unconfirmed_valves()[kArm], lost == bus.valve(kArm).tpdo_id());
    machine.expect_watched();
  }
}

/// The nodes' object 0x1029:01 is 0: on a communication error they go pre-operational and send no process data.
struct Resting {
  /// @param frozen joint whose valve goes on saying what it said before.
  /// @param enable_alone the valves stay operational, as others do.
  explicit Resting(const MachineDescription& machine, std::optional<int> frozen = std::nullopt,
                   bool enable_alone = false)
      : bench(machine) {
    const auto rests = [&](const NodeDescription& node) {
      return enable_alone ? node.role == NodeRole::kEnable : node.is_told();
    };
    for (const NodeDescription& node : machine.bus.nodes)
      if (rests(node)) bench.nodes.node(node.id)->add(canopen::kErrorBehaviour, 1, sim::Access::kReadWrite);
    EXPECT_TRUE(bench.engage()) << text(bench.loop.blocking());
    if (frozen) bench.nodes.inject(machine.bus.valve(*frozen).id, sim::NodeFault::kFrozen);
    bench.can.lost = {canopen::heartbeat_id(machine.bus.controller_id)};
    bench.run(300ms);
    for (const NodeDescription& node : machine.bus.nodes)
      EXPECT_NE(bench.nodes.node(node.id)->operational(), rests(node)) << node.name;
    bench.can.lost.clear();
    bench.hung = true;
    bench.wire.clear();
  }
  void take_out_of_service() { test::take_out_of_service(bench, stop); }
  test::BenchMachine bench;
  OrderlyStop stop{bench.description, bench.can};
};

TEST(OrderlyStop, NodesThatWentPreOperationalConfirmBySdo) {
  MachineDescription joined = test::test_machine();
  test::join_valves(joined.bus);
  for (const MachineDescription& machine : {test::test_machine(), joined}) {
    Resting resting(machine);
    resting.take_out_of_service();
    EXPECT_EQ(resting.stop.unconfirmed_valves(), (PerJoint<bool>{}));
    EXPECT_FALSE(resting.stop.unconfirmed_pilot());
    EXPECT_EQ(resting.bench.frames(canopen::kNmtId).size(), machine.bus.nodes.size());
  }
  Resting enable(test::test_machine(), std::nullopt, true);
  enable.take_out_of_service();
  EXPECT_FALSE(enable.stop.unconfirmed_pilot()) << "although the valves are at rest at once";
}

TEST(OrderlyStop, ANodeThatWentPreOperationalAndDoesNotSayThatItIsOffIsNotBelievedToBe) {
  Resting resting(test::test_machine(), kArm);
  const BusDescription& bus = resting.bench.description.bus;
  resting.bench.can.lost = {canopen::sdo_response_id(bus.enable().id)};
  resting.take_out_of_service();
  EXPECT_EQ(resting.stop.unconfirmed_valves(), (PerJoint<bool>{false, true, false}))
      << "it still says that it is active";
  EXPECT_TRUE(resting.stop.unconfirmed_pilot()) << "not answered";
  EXPECT_TRUE(resting.bench.frames(canopen::kNmtId).empty());
}

TEST(OrderlyStop, AnAnswerToSomebodyElseConfirmsNothingOfANodeThatIsOperational) {
  BenchMachine bench;
  ASSERT_TRUE(bench.engage()) << text(bench.loop.blocking());
  bench.hung = true;
  const NodeDescription& arm = wires().valve(kArm);
  bench.can.lost = {arm.tpdo_id()};
  OrderlyStop stop(bench.description, bench.can);
  while (!stop.done()) {
    bench.bus.port(2).send(canopen::sdo_uploaded(arm.id, canopen::kValveStatusWord, canopen::kControlDisabled, 2));
    stop.step(bench.now);
    bench.run(5ms);
  }
  EXPECT_EQ(stop.unconfirmed_valves(), (PerJoint<bool>{false, true, false}));
}

TEST(OrderlyStop, OpensNoValveAndResetsNoNodeThatDidNotConfirmWhateverIsLost) {
  std::vector<std::uint32_t> ids{wires().enable().rpdo_id(), wires().enable().tpdo_id()};
  for (const NodeDescription& valve : test::nodes_with(wires(), NodeRole::kValve))
    ids.insert(ids.end(), {valve.rpdo_id(), valve.tpdo_id()});
  std::mt19937 rng(11);
  for (int run = 0; run < 24; ++run) {
    std::vector<std::uint32_t> lost;
    for (const std::uint32_t id : ids)
      if (rng() % 4 == 0) lost.push_back(id);
    Stopped machine(lost);
    ASSERT_TRUE(machine.moving);
    for (const auto& w : machine.bench.wire) {
      for (const NodeDescription& valve : test::nodes_with(wires(), NodeRole::kValve)) {
        if (w.frame.id != valve.rpdo_id() || w.at <= machine.since + kPeriod) continue;
        EXPECT_EQ(canopen::parse_valve_command(w.frame).value().set_point, 0) << run;
      }
    }
    const auto open = machine.stop.unconfirmed_valves();
    const bool confirmed = !machine.stop.unconfirmed_pilot() && std::count(open.begin(), open.end(), true) == 0;
    // A node that misses its command may still confirm, once its own watchdog has acted; one that is not heard may not.
    bool unheard = false;
    for (const std::uint32_t id : lost) {
      unheard = unheard || id == wires().enable().tpdo_id();
      for (const NodeDescription& valve : test::nodes_with(wires(), NodeRole::kValve))
        unheard = unheard || id == valve.tpdo_id();
    }
    EXPECT_FALSE(confirmed && unheard) << run;
    EXPECT_TRUE(confirmed || !lost.empty()) << run;
    EXPECT_EQ(machine.count(canopen::kNmtId), confirmed ? 14 : 0) << run;
    machine.bench.run(500ms);
    EXPECT_FALSE(machine.bench.nodes.outputs().pilot) << run;
    EXPECT_EQ(machine.bench.nodes.outputs().spool_demand, JointVector(0, 0, 0)) << run;
  }
}

}  // namespace
}  // namespace knuckle::slave
