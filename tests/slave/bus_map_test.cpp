// The map from the machine file against what is on the wire.
#include "slave/bus_map.h"

#include <gtest/gtest.h>

#include <map>
#include <tuple>

#include "machine/bus_budget.h"
#include "machine/load.h"
#include "tests/slave/bench_machine.h"
#include "tests/support/bus_nodes.h"
#include "tests/support/multiplexed_machine.h"

namespace knuckle::slave {
namespace {

using test::BenchMachine;

TEST(BusMap, IsWhatTravelsInOperationAndWhatTheControllerHears) {
  // Several frames may come under one identifier.
  const std::tuple<const char*, MachineDescription, int> machines[] = {{"nodes", test::test_machine(), 1},
                                                                       {"broadcasts", test::broadcast_machine(), 1},
                                                                       {"in turn", test::multiplexed_machine(), 2}};
  for (const auto& [name, machine, within] : machines) {
    SCOPED_TRACE(name);
    BenchMachine m(machine);
    ASSERT_TRUE(m.engage()) << m.fault();
    m.run(1s);
    m.wire.clear();
    m.run(2s);
    EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << m.fault();
    const auto measured = m.loop.sensors().measurement().value();
    for (int i = 0; i < kJoints; ++i) EXPECT_NEAR(measured.cylinder_m[i], m.signals.cylinder_m[i], 3e-4) << i;
    std::map<std::uint32_t, std::pair<int, int>> seen;  // frames, size
    for (const auto& w : m.wire) seen[w.frame.id] = {seen[w.frame.id].first + 1, w.frame.size};
    const auto map = bus_map(m.description.bus);
    const auto heard = heard_by_controller(m.description.bus);
    EXPECT_EQ(seen.size(), map.size());
    for (const PeriodicFrame& f : map) {
      EXPECT_NEAR(seen[f.id].first, 2 * f.rate_Hz, within) << std::hex << f.id;
      EXPECT_EQ(seen[f.id].second, f.size) << std::hex << f.id;
      EXPECT_TRUE(hears(heard, f.id)) << std::hex << f.id;
    }
  }
}

TEST(BusMap, ControllerHearsAllThatItsNodesSendAndAllThatNobodyElseMaySend) {
  BenchMachine m;
  const auto heard = heard_by_controller(m.description.bus);
  EXPECT_EQ(heard.size(), 14U * 5U + 4U + 3U) << "5 of each node, 4 set-points and outputs, NMT, SYNC, heartbeat";
  ASSERT_TRUE(m.engage());
  ASSERT_TRUE(m.nodes.send_emcy(0x25, 0x5030));
  m.run(100ms);
  for (const auto& w : m.wire)
    EXPECT_EQ(std::count(heard.begin(), heard.end(), w.frame.id), 1) << std::hex << w.frame.id;
}

/// Bytes that a node's script tells it to map into its first PDO: entries of this object, 8 bits a byte.
int told_to_map(const SdoScript& script, std::uint16_t mapping_object) {
  int bits = 0;
  for (const SetupPart& part : script) {
    for (const SdoStep& step : part.written) {
      const bool entry = step.object.index == mapping_object && step.object.subindex > 0;
      if (entry) bits += static_cast<int>(step.value & 0xFFU);
    }
  }
  return bits / 8;
}

TEST(BusMap, CountsTheBytesThatNodesAreToldToSendWhateverTheMachineFileMaps) {
  using Pressure = WireDescription::Pressure;
  for (const Pressure pressure : {Pressure::kInteger, Pressure::kFloat, Pressure::kInteger16}) {
    MachineDescription machine = load_machine(find_config("machine", "solar015"));
    machine.bus.wire.pressure = pressure;
    test::node_in(machine.bus, NodeRole::kPressure, 2).tpdos[0] = 0x2A5;
    std::map<std::uint32_t, int> mapped;
    for (const PeriodicFrame& f : bus_map(machine.bus)) mapped[f.id] = f.size;
    for (const NodeScript& node : node_scripts(machine)) {
      EXPECT_EQ(told_to_map(node.script, 0x1A00), mapped[node.node.tpdo_id()]) << node.node.name;
      const int hears = told_to_map(node.script, 0x1600);
      if (hears == 0) continue;
      EXPECT_EQ(hears, mapped[node.node.rpdo_id()]) << node.node.name;
    }
  }
}

TEST(BusMap, MachineFilesLoadTheirBusesWithinSixtyPercent) {
  for (const char* name : {"solar015", "compact080"}) {
    const BusDescription bus = load_machine(find_config("machine", name)).bus;
    const CanLoad load = can_load(bus_map(bus), bus.bit_rate);
    EXPECT_LE(load.worst_case, 0.60) << name;
  }
}

}  // namespace
}  // namespace knuckle::slave
