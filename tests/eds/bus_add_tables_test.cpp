// `knuckle bus add` in machine files with [[bus.node]] tables.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>

#include "app/eds/bus_command.h"
#include "app/eds/migrate.h"
#include "machine/load.h"
#include "tests/eds/made_device.h"
#include "tests/support/axes_machine.h"
#include "tests/support/few_nodes.h"

namespace knuckle::eds {
namespace {

using test::all_changed;
using test::keyed;
using test::machine;
using test::made_for;
using test::refused;
using test::replaced;
using test::says;
using test::shipped_text;
using test::with_fixed;

std::string block_of(const std::string& text, const std::string& name) {
  const auto begin = text.rfind("[[bus.node]]", text.find("name = \"" + name + '"'));
  return text.substr(begin, text.find("\n\n", begin) + 1 - begin);
}

TEST(BusAddToNodeTables, ChangesWhatDependsOnTheDeviceInTheTableOfTheNodeAndNothingElse) {
  const std::string before = replaced(replaced(shipped_text(), "id = 0x11", "id = 0x11      # its switches: 2"),
                                      "name = \"arm_valve\"", "# Behind the cab.\nname = \"arm_valve\"  # mine");
  const std::string text = with_device(before, "my.toml", "arm_valve", 0x50, made_for("arm_valve"));
  EXPECT_EQ(block_of(text, "arm_valve"),
            "[[bus.node]]\n# Behind the cab.\nname = \"arm_valve\"  # mine\nprofile = \"cia408\"\n"
            "channels = { 1 = \"arm_spool\" }\nid = 0x50      # its switches: 2\ndevice_type = 0x198\n"
            "vendor = 0x1234\nproduct = 0x5678\n");
  EXPECT_EQ(replaced(text, block_of(text, "arm_valve"), block_of(before, "arm_valve")), before);
}

TEST(BusAddToNodeTables, FindsTheKeysInAnyOrderAndTheNodeByItsSignalAndKeepsLineEnds) {
  const std::string block =
      "[[bus.node]]\nproduct = 1\nchannels.1 = \"slope\"\nvendor = 0x02\nid = 56\n"
      "name = 'inclination'\nprofile = \"cia410\"\ndevice_type = 0x019A\n";
  const std::string text = replaced(shipped_text(), block_of(shipped_text(), "tilt"), block);
  const std::string wanted = replaced(text, block,
                                      "[[bus.node]]\nproduct = 0x5678\nchannels.1 = \"slope\"\nvendor = 0x1234\n"
                                      "id = 0x39\nname = 'inclination'\nprofile = \"cia410\"\ndevice_type = 0x19A\n");
  const auto added = [](const std::string& before, const char* node) {
    return with_device(before, "my.toml", node, 0x39, made_for("tilt"));
  };
  EXPECT_EQ(added(text, "inclination"), wanted);
  EXPECT_EQ(added(text, "slope"), wanted);
  EXPECT_EQ(added(test::with_crlf(text), "slope"), test::with_crlf(wanted));
  EXPECT_EQ(added(wanted, "slope"), wanted) << "its own id";
}

TEST(BusAddToNodeTables, WritesTheProfileOfAValveAndTheIdentifiersThatCannotBeMovedAndTakesOutOldOnes) {
  DeviceFile pved = with_fixed(with_fixed(made_for("arm_valve"), 0x180001, 0x280), 0x140001, 0x300);
  pved.vendor = 0x01000019;
  pved.product = 0x53373235;
  const std::string text = with_device(shipped_text(), "my.toml", "arm_valve", 0x11, pved);
  EXPECT_EQ(block_of(text, "arm_valve"),
            "[[bus.node]]\nname = \"arm_valve\"\nprofile = \"cia408/pved\"\nchannels = { 1 = \"arm_spool\" }\n"
            "id = 0x11\ndevice_type = 0x198\nvendor = 0x1000019\nproduct = 0x53373235\ntpdo = 0x291\nrpdo = 0x311\n");
  EXPECT_EQ(with_device(text, "my.toml", "arm_valve", 0x11, pved), text) << "once more";
  EXPECT_EQ(with_device(test::with_crlf(shipped_text()), "my.toml", "arm_valve", 0x11, pved), test::with_crlf(text));
  const std::string moved = with_device(text, "my.toml", "arm_valve", 0x13, pved);
  EXPECT_TRUE(says(moved, "\ntpdo = 0x293\nrpdo = 0x313\n"));
  const std::string noted = replaced(text, "tpdo = 0x291", "tpdo = 0x291  # as delivered");
  EXPECT_EQ(block_of(with_device(noted, "my.toml", "arm_valve", 0x11, made_for("arm_valve")), "arm_valve"),
            "[[bus.node]]\nname = \"arm_valve\"\nprofile = \"cia408\"\nchannels = { 1 = \"arm_spool\" }\n"
            "id = 0x11\ndevice_type = 0x198\nvendor = 0x1234\nproduct = 0x5678\n# as delivered\n");
}

TEST(BusAddToNodeTables, RefusesInOneLineWhatItCannotChange) {
  std::string text = with_node_tables(keyed(), "my.toml");  // without comments
  const DeviceFile tilt = made_for("tilt");
  const std::string needs = "my.toml: needs tilt in a [[bus.node]] table with each key on a line of its own";
  EXPECT_EQ(refused("tilt", 0x39, tilt, replaced(text, "id = 0x38", "\"id\" = 0x38")), needs);
  std::string array = "node = [";
  for (auto at = text.find("[[bus.node]]"); at != std::string::npos; at = text.find("[[bus.node]]")) {
    const std::string block = text.substr(at, text.find("\n\n", at) + 2 - at);
    text.erase(at, block.size());
    std::string line = block.substr(block.find('\n') + 1);
    line = line.substr(0, line.find_last_not_of('\n') + 1);
    array += "\n{ " + all_changed(line, "\n", ", ") + " },";
  }
  text = replaced(text, "controller_id = 1\n", "controller_id = 1\n" + array + "\n]\n\n");
  ASSERT_EQ(parse_machine(text, "my.toml").bus.nodes, machine().bus.nodes);
  EXPECT_EQ(refused("tilt", 0x39, tilt, text), needs);
}

TEST(BusAddToNodeTables, OfATransmitterOfManyPressuresEachChannelsObjectsMustBeThere) {
  const MachineDescription few = parse_machine(test::few_nodes_text(), "few.toml");
  const DeviceFile six = made_for("pressures", few);
  EXPECT_TRUE(fit_of(six, few, "pressures").obstacles.empty());
  EXPECT_TRUE(fit_of(six, few, "arm_rod_pressure").obstacles.empty()) << "by the name of a signal";
  for (const int channel : {1, 2, 3, 4, 6, 7}) {
    DeviceFile five = six;
    five.entries.erase(0x613100 + static_cast<std::uint32_t>(channel));
    EXPECT_TRUE(says(fit_of(five, few, "pressures").obstacles,
                     fmt::format("start-up reads 0x6131:{:02X}, which the device does not have", channel)));
  }
  for (const std::uint32_t second : {0x180101U, 0x180102U, 0x1A0100U}) {
    DeviceFile one_frame = six;
    one_frame.entries.erase(second);
    EXPECT_FALSE(fit_of(one_frame, few, "pressures").obstacles.empty()) << second;
  }
  const std::string text = with_device(few.text, "few.toml", "bucket_rod_pressure", 0x21,
                                       with_fixed(with_fixed(six, 0x180001, 0x1A0), 0x180101, 0x280));
  const NodeDescription node = *parse_machine(text, "few.toml").bus.find("pressures");
  EXPECT_EQ(node.id, 0x21);
  EXPECT_EQ(node.channels, few.bus.find("pressures")->channels);
  EXPECT_EQ(node.tpdos, (std::array<std::uint16_t, 4>{0x1C1, 0, 0, 0}));
  EXPECT_TRUE(says(text, "product = 0x5678\ntpdo = 0x1C1\nchannels = "));
  const std::string other = with_device(few.text, "few.toml", "pressures", 0x21, with_fixed(six, 0x180101, 0x290));
  EXPECT_EQ(parse_machine(other, "few.toml").bus.find("pressures")->tpdos, (std::array<std::uint16_t, 4>{0, 0x2B1}));
}

TEST(BusAddToNodeTables, OfAValveOfSeveralAxesEachAxisObjectsAndPdosMustBeThere) {
  const MachineDescription joined = parse_machine(test::axes_text(), "axes.toml");
  const DeviceFile three = made_for("valves", joined);
  EXPECT_TRUE(fit_of(three, joined, "arm_spool").obstacles.empty()) << "by the name of a signal";
  for (const std::uint32_t one :
       {0x604000U, 0x684000U, 0x704000U, 0x630001U, 0x6B0001U, 0x730001U, 0x140101U, 0x160200U, 0x180101U, 0x1A0200U}) {
    DeviceFile less = three;
    less.entries.erase(one);
    EXPECT_FALSE(fit_of(less, joined, "valves").obstacles.empty()) << one;
  }
  DeviceFile timers = three;
  timers.entries.erase(0x101601);
  EXPECT_TRUE(fit_of(timers, joined, "valves").obstacles.empty()) << "all three timers are a guard";
  timers.entries.erase(0x140205);
  EXPECT_TRUE(says(fit_of(timers, joined, "valves").obstacles, "it has no guard that start-up knows"));
  const std::string text = with_device(joined.text, "axes.toml", "bucket_spool", 0x11,
                                       with_fixed(with_fixed(three, 0x140201, 0x440), 0x180101, 0x2A0));
  const NodeDescription node = *parse_machine(text, "axes.toml").bus.find("valves");
  EXPECT_EQ(node.id, 0x11);
  EXPECT_EQ(node.channels, joined.bus.find("valves")->channels);
  EXPECT_EQ(node.rpdos, (std::array<std::uint16_t, 4>{0, 0, 0x451, 0}));
  EXPECT_EQ(node.tpdos, (std::array<std::uint16_t, 4>{0, 0x2B1, 0, 0}));
  EXPECT_TRUE(says(text, "tpdo2 = 0x2B1\nrpdo3 = 0x451\n"));
  const std::string moved = with_device(text, "axes.toml", "valves", 0x12, three);
  EXPECT_FALSE(says(moved, "rpdo3")) << "where the device has the usual one";
}

}  // namespace
}  // namespace knuckle::eds
