// [[bus]] twice: a machine with two buses, as its file has them.
#include <gtest/gtest.h>

#include "machine/bus_budget.h"
#include "machine/reason_text.h"
#include "tests/support/command_machine.h"
#include "tests/support/refused_changes.h"
#include "tests/support/two_buses.h"

namespace knuckle {
namespace {

MachineDescription parsed(const std::string& text) {
  return parse_machine(text, "m.toml");
}

std::string changed(const std::string& from, const std::string& to, const std::string& text = test::two_buses_text()) {
  return test::replaced(text, from, to);
}

TEST(TwoBusesFile, SaysWhatIsOnEach) {
  const BusDescription bus = parsed(test::two_buses_text()).bus;
  ASSERT_EQ(bus.lines(), 2U);
  EXPECT_EQ(bus.line(0), (BusLine{"valves", 500000, 0}));
  EXPECT_EQ(bus.line(1), (BusLine{"machine", 250000, 0}));
  EXPECT_EQ(bus.nodes.size(), 4U);
  for (const BroadcastFrame& frame : bus.broadcasts) EXPECT_NE(frame.id & kSecondBus, 0U) << frame.name;
  EXPECT_EQ(bus.broadcasts[0].id, 0x18FF1021U | kExtendedId | kSecondBus);
  EXPECT_EQ(bus.broadcasts[2].id, 0x190U | kSecondBus) << "the boom valve's on the other bus";
  EXPECT_EQ(bus.line_named("machine"), 1U);
  EXPECT_EQ(bus.line_named("tracks"), std::nullopt);
}

TEST(TwoBusesFile, EachAloneIsABusOfItsOwn) {
  const BusDescription bus = parsed(test::two_buses_text()).bus, valves = bus.alone(0), machine = bus.alone(1);
  EXPECT_EQ(valves.nodes, bus.nodes);
  EXPECT_TRUE(valves.broadcasts.empty());
  EXPECT_EQ(machine.lines(), 1U);
  EXPECT_TRUE(machine.without_nodes());
  EXPECT_EQ(machine.broadcasts[2].id, 0x190U);
  EXPECT_EQ(machine.bit_rate, 250000U);
  // At worst 160 bits with 8 bytes, 140 with 6 (29 bits of identifier); 95 with 4 bytes.
  EXPECT_NEAR(worst_bus_load(machine), (100 * 160 + 100 * 140 + 50 * 95) / 250e3, 1e-9);
  const BusDescription one = parsed(test::broadcast_text()).bus;
  EXPECT_EQ(one.alone(0), one);
  EXPECT_NEAR(worst_bus_load(valves) + (100 * 160 + 100 * 140 + 50 * 95) / 500e3, worst_bus_load(one), 1e-9);
}

TEST(TwoBusesFile, CommandsMayBeOnTheOneAndBroadcastsOnTheOther) {
  const BusDescription bus = parsed(test::on_two_buses(test::command_text())).bus;
  EXPECT_TRUE(bus.by_frames());
  EXPECT_EQ(bus.commands[0].id & kSecondBus, 0U);
  EXPECT_EQ(bus.broadcasts[0].id & kSecondBus, kSecondBus);
}

TEST(TwoBusesFile, ReasonsNameTheBus) {
  const BusDescription bus = parsed(test::two_buses_text()).bus, one = parsed(test::broadcast_text()).bus;
  EXPECT_EQ(subject_text({ReasonCode::kSensorStale, subject_of(NodeRole::kTilt, 0, bus), 60, 50}, bus),
            "body (0x190, bus machine), slope");
  EXPECT_EQ(subject_text({ReasonCode::kNodeSilent, 0x10, 60, 50}, bus), "boom_valve (node 0x10), bus valves");
  for (const ReasonCode code : {ReasonCode::kBusOff, ReasonCode::kBusPassive, ReasonCode::kBusDown}) {
    EXPECT_EQ(subject_text({code, 0, 0, 0}, bus), "bus valves");
    EXPECT_EQ(subject_text({code, 1, 0, 0}, bus), "bus machine");
    EXPECT_EQ(subject_text({code, 0, 0, 0}, one), "");
    EXPECT_EQ(subject_text({code, 1, 0, 0}), "bus 2") << "who does not know the machine";
  }
}

TEST(TwoBusesFile, WhatOthersSendCountsInTheBudget) {
  const auto with = [](const char* percent) {
    return changed("bit_rate_kbps = 250", std::string("bit_rate_kbps = 250\nforeign_load_percent = ") + percent);
  };
  EXPECT_NEAR(parsed(with("40")).bus.second->foreign_load, 0.4, 1e-12);
  const std::string said = test::machine_refusal(with("50"));
  EXPECT_TRUE(
      test::says(said,
                 "key 'bus[1].bit_rate_kbps' = 250: too slow: these frames load the bus to 63.9 % with worst-case "
                 "stuffing and those of others; must be at most 60 %; would fit: bit_rate_kbps = 500 (32 %)"));
  const std::string one = changed("\n[bus]", "\n[bus]\nforeign_load_percent = 60", test::broadcast_text());
  EXPECT_TRUE(test::says(test::machine_refusal(one), "and those of others; must be at most 60 %"));
}

TEST(TwoBusesFile, WhatCannotBeIsRefusedInOneLine) {
  test::expect_refused(
      {
          {"name = \"machine\"", "name = \"valves\"", "key 'bus[1].name' = 'valves': is the name of the other bus"},
          {"name = \"machine\"", "name = \"can=1\"", "must be a letter and up to 14 letters, digits and _"},
          {"name = \"machine\"\n", "", "key 'bus[1].name' is missing"},
          {"name = \"valves\"\n", "", "key 'bus[0].name' is missing"},
          {"bit_rate_kbps = 250", "bit_rate_kbps = 251", "must be one of CANopen's"},
          {"bit_rate_kbps = 250", "bit_rate_kbps = 250\nsync_Hz = 100", "key 'bus[1].sync_Hz' = 100: unknown key"},
          {"bit_rate_kbps = 250", "bit_rate_kbps = 250\nforeign_load_percent = -1", "must be within [0, 60]"},
          {"id = 0x18FF2021", "id = 0x18FF1021", "is taken by 'front_angle'"},
          {"name = \"pressure_1\"", "name = \"front_angle\"", "is the name of another frame"},
          {"id = 0x190", "id = 0x601", "has 0x601, the identifier of SDO requests"},
          {"[[bus.broadcast]]", "[[bus.node]]\nname = \"x\"\n[[bus.broadcast]]",
           "must be of the first [[bus]]: all nodes are on one"},
          {"[[bus]]\nname = \"machine\"", "[[bus]]\nname = \"third\"\nbit_rate_kbps = 125\n[[bus]]\nname = \"machine\"",
           "key 'bus' = an array of 3 tables: must be two at most"},
      },
      [](const auto& from, const auto& to) { (void)parsed(changed(from, to)); });
  const std::string empty = test::broadcast_text() + "\n";
  const std::string said = test::machine_refusal(changed("\n[bus]", "\n[[bus]]\nname = \"valves\"", empty) +
                                                 "[[bus]]\nname = \"machine\"\nbit_rate_kbps = 250\n");
  EXPECT_TRUE(test::says(said, "must have a [[bus.broadcast]] or a [[bus.command]]"));
}

TEST(TwoBusesFile, OneInDoubleBracketsIsOne) {
  const BusDescription bus = parsed(changed("\n[bus]", "\n[[bus]]", test::broadcast_text())).bus;
  EXPECT_EQ(bus, parsed(test::broadcast_text()).bus);
}

}  // namespace
}  // namespace knuckle
