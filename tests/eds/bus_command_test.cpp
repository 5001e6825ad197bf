// `knuckle bus add`: a machine file with a device that is sold, or why it cannot be.
#include "app/eds/bus_command.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "app/eds/migrate.h"
#include "core/error.h"
#include "machine/bus_frames.h"
#include "machine/load.h"
#include "sim/can_nodes.h"
#include "slave/canopen_client.h"
#include "slave/node_setup.h"
#include "tests/support/axes_machine.h"
#include "tests/support/few_nodes.h"
#include "tests/support/keyed_nodes.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"
#include "transport/virtual_can.h"

namespace knuckle::eds {
namespace {

const std::string kDevices = test::source_dir() + "/../shared/data/devices/";

std::string solar() {
  return test::content(test::source_dir() + "/config/machines/solar015.toml");
}
/// The same machine in the older words.
std::string keyed() {
  return test::with_keyed_nodes(solar());
}
MachineDescription machine() {
  return parse_machine(solar(), "my.toml");
}

/// As CiA 301 numbers it.
std::uint16_t type_of(const FrameField& field) {
  const std::uint16_t size = field.bits.bits == 8 ? 0 : field.bits.bits == 16 ? 1 : 2;
  if (field.bits.type == BitField::Type::kFloat) return 8;
  return static_cast<std::uint16_t>((field.bits.type == BitField::Type::kSigned ? 2 : 5) + size);
}

/// A device that has all that the start-up of this node writes, asks for and maps.
DeviceFile made_for(const std::string& node, const MachineDescription& of = machine()) {
  DeviceFile device;
  device.source = "a.eds";
  const auto scripts = slave::node_scripts(of);
  const auto script =
      std::find_if(scripts.begin(), scripts.end(), [&](const auto& one) { return one.node.name == node; });
  for (const slave::SetupPart& part : script->script) {
    for (const slave::SdoStep& step : part.asked) {
      Entry& entry = device.entries[std::uint32_t{step.object.index} << 8 | step.object.subindex];
      entry.access = part.written.empty() ? Access::kReadOnly : Access::kReadWrite;
      entry.value = Value{step.value, false};
      entry.line = 1;
    }
  }
  for (const BusFrame& frame : bus_frames(of.bus, of.sensors)) {
    if (of.bus.nodes[frame.node].name != node) continue;
    for (const FrameField& field : frame.fields) {
      Entry& entry = device.entries[std::uint32_t{field.object.index} << 8 | field.object.subindex];
      entry.data_type = type_of(field);
      if (frame.to_node) entry.access = Access::kReadWrite;
      if (!entry.value) entry.value = Value{};
    }
  }
  device.device_type = script->node.device_type;
  device.vendor = 0x1234;
  device.product = 0x5678;
  return device;
}
bool tells(const std::vector<std::string>& lines, const std::string& what) {
  return std::any_of(lines.begin(), lines.end(), [&](const auto& l) { return l.find(what) != std::string::npos; });
}
std::string refused(const std::string& node, std::uint8_t id, const DeviceFile& device,
                    const std::string& text = solar()) {
  try {
    (void)with_device(text, "my.toml", node, id, device);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(BusAddToKeyedNodes, ChangesTheOneLineOfTheNodeAndNothingElse) {
  const std::string text = with_device(keyed(), "my.toml", "boom_valve", 0x50, made_for("boom_valve"));
  const MachineDescription after = parse_machine(text, "my.toml");
  EXPECT_EQ(after.bus.valve(0).id, 0x50);
  EXPECT_EQ(after.bus.valve(0).vendor, 0x1234U);
  EXPECT_EQ(after.bus.valve(0).product, 0x5678U);
  EXPECT_EQ(after.bus.valve(0).tpdos[0], 0);
  std::istringstream was(keyed()), is(text);
  int changed = 0;
  for (std::string a, b; std::getline(was, a) && std::getline(is, b);) changed += a != b ? 1 : 0;
  EXPECT_EQ(changed, 1);
}

TEST(BusAddToKeyedNodes, KeepsTheIdentifierOfAPdoThatCannotBeMoved) {
  DeviceFile device = made_for("tilt");
  Entry& cob_id = device.entries[0x180001];
  cob_id.access = Access::kReadOnly;
  cob_id.value = Value{0x280, true};
  EXPECT_EQ(parse_machine(with_device(keyed(), "m", "tilt", 0x38, device), "m").bus.tilt().tpdos[0], 0x2B8);
  cob_id.value = Value{0x180, true};
  EXPECT_EQ(parse_machine(with_device(keyed(), "m", "tilt", 0x38, device), "m").bus.tilt().tpdos[0], 0);
}

/// Read-only. @param number of the PDO, from 0.
void set_map(DeviceFile& device, std::uint32_t number, const std::vector<std::uint32_t>& entries) {
  for (std::uint32_t i = 0; i <= entries.size(); ++i) {
    Entry& entry = device.entries[(0x1A0000 + 0x100 * number) | i];
    entry.access = Access::kReadOnly;
    entry.value = Value{i == 0 ? static_cast<std::uint32_t>(entries.size()) : entries[i - 1], false};
  }
}

TEST(BusAdd, TakesAMappingThatCannotBeChangedAsItIs) {
  DeviceFile device = made_for("tilt");
  const auto map = [&](std::uint32_t number, const std::vector<std::uint32_t>& entries) {
    set_map(device, number, entries);
  };
  map(0, {0x60100010});
  EXPECT_TRUE(parse_machine(with_device(solar(), "m", "tilt", 0x38, device), "m").bus.tilt().tpdo_maps.empty());
  map(0, {0x60200010, 0x60100010});
  const std::string text = with_device(solar(), "m", "tilt", 0x38, device);
  EXPECT_NE(text.find("tpdo_map = [0x60200010, 0x60100010]"), std::string::npos);
  const MachineDescription after = parse_machine(text, "m");
  EXPECT_EQ(after.bus.tilt().tpdo_maps, (std::vector<std::vector<std::uint32_t>>{{0x60200010, 0x60100010}}));
  EXPECT_TRUE(fit_of(device, after, "tilt").obstacles.empty());
  // The next device in its place leaves none of it behind.
  EXPECT_EQ(with_device(text, "m", "tilt", 0x38, made_for("tilt")).find("tpdo_map"), std::string::npos);
  EXPECT_NE(refused("tilt", 0x38, device, keyed()).find("knuckle bus migrate"), std::string::npos);
  map(0, {0x60200010});
  EXPECT_NE(refused("tilt", 0x38, device).find("must have 0x60100010"), std::string::npos)
      << refused("tilt", 0x38, device);
}

TEST(BusAdd, OfFourMappingsThatCannotBeChangedTakesThoseThatMapSomething) {
  DeviceFile device = made_for("tilt");
  set_map(device, 0, {0x60100010});
  for (const std::uint32_t pdo : {1U, 2U, 3U}) set_map(device, pdo, {});
  const auto added = [&] { return with_device(solar(), "m", "tilt", 0x38, device); };
  EXPECT_EQ(added().find("_map = "), std::string::npos) << "as start-up wants it";
  set_map(device, 0, {0x60200010, 0x60100010});
  EXPECT_NE(added().find("tpdo_map = [0x60200010, 0x60100010]"), std::string::npos);
  EXPECT_EQ(added().find("tpdo2_map"), std::string::npos);
  EXPECT_TRUE(fit_of(device, parse_machine(added(), "m"), "tilt").obstacles.empty());
  for (const std::uint32_t count : {9U, 0xFEU, 0xFFU, 0x100U}) {  // those from 0xFE on are no lists
    device.entries[0x1A0100].value = Value{count, false};
    EXPECT_NE(added().find("tpdo_map = [0x60200010, 0x60100010]"), std::string::npos) << count;
    EXPECT_EQ(added().find("tpdo2_map"), std::string::npos) << count;
  }
}

TEST(BusAdd, TellsOfAMappingThatAMachineFileCannotSay) {
  DeviceFile gap = made_for("tilt");
  set_map(gap, 0, {0x60200010, 0x60100010});
  set_map(gap, 1, {});
  set_map(gap, 2, {0x60200010});
  DeviceFile unknown = made_for("tilt");
  set_map(unknown, 0, {0x60200010, 0x60100010});
  unknown.entries[0x1A0002].value.reset();
  for (const DeviceFile& device : {gap, unknown}) {
    const std::string text = with_device(solar(), "m", "tilt", 0x38, device);
    EXPECT_EQ(text.find("_map = "), std::string::npos);
    EXPECT_TRUE(tells(fit_of(device, parse_machine(text, "m"), "tilt").obstacles, "which can only be read"));
  }
}

TEST(BusAdd, RefusesWhatIsNoMachineFileAfterwards) {
  const DeviceFile valve = made_for("boom_valve");
  EXPECT_NE(refused("swing_valve", 0x11, valve).find("has no node 'swing_valve'; its nodes: boom_valve"),
            std::string::npos);
  EXPECT_EQ(refused("tilt", 0x38, valve),
            "a.eds: 0x1000:00 = 0x198: is a device of CiA 408; tilt must be one of CiA 410");
  DeviceFile of_no_profile = made_for("tilt");
  of_no_profile.device_type = 0x80000;
  EXPECT_EQ(refused("tilt", 0x38, of_no_profile), "accepted");
}

TEST(BusAddToKeyedNodes, RefusesANodeThatIsATableOfItsOwn) {
  std::string table = keyed();
  const auto at = table.find("boom_valve           = {"), end = table.find('}', at);
  table.replace(at, end - at + 1, "");
  table += "\n[bus.nodes.boom_valve]\nid = 0x10\ndevice_type = 0x0198\nvendor = 0x4B4E\nproduct = 0x0408\n";
  EXPECT_EQ(
      refused("boom_valve", 0x10, made_for("boom_valve"), table),
      fmt::format("my.toml: line {}: [bus.nodes.boom_valve] is a table of its own: needs boom_valve = {{ ... }} on "
                  "one line in [bus.nodes], or [[bus.node]] tables (knuckle bus migrate)",
                  std::count(table.begin(), table.end(), '\n') - 4));
}

TEST(BusAdd, FindsNothingAgainstADeviceThatHasAllItsStartUpWants) {
  for (const slave::NodeScript& node : slave::node_scripts(machine())) {
    const Fit fit = fit_of(made_for(node.node.name), machine(), node.node.name);
    EXPECT_TRUE(fit.obstacles.empty()) << node.node.name << ": " << fit.obstacles[0];
    EXPECT_TRUE(fit.to_set.empty()) << node.node.name << ": " << fit.to_set[0];
  }
}

TEST(BusAdd, NamesEverythingAtWhichStartUpWouldFail) {
  DeviceFile device = made_for("boom_valve");
  device.bit_rates_kbps = {125, 250};
  device.entries.erase(0x101601);
  device.entries.erase(0x101700);
  device.entries[0x180002].access = Access::kReadOnly;
  device.entries[0x180002].value = Value{254, false};
  device.entries[0x140005].access = Access::kReadOnly;
  device.entries[0x140005].value = Value{0, false};
  device.entries[0x604200].value = Value{2, false};
  const Fit fit = fit_of(device, machine(), "boom_valve");
  EXPECT_EQ(fit.obstacles.size(), 5U);
  EXPECT_TRUE(tells(fit.obstacles, "the bus has 500 kbit/s"));
  EXPECT_TRUE(tells(fit.obstacles, "start-up reads 0x1017:00, which the device does not have"));
  EXPECT_TRUE(tells(fit.obstacles, "start-up writes 0x1800:02, which can only be read"));
  EXPECT_TRUE(tells(fit.obstacles, "without its controller it would not stop"));
  EXPECT_TRUE(tells(fit.obstacles, "0x6042:00 must be 1 and is always 2"));
  device.entries[0x604200].access = Access::kReadWrite;
  EXPECT_TRUE(tells(fit_of(device, machine(), "boom_valve").to_set,
                    "set 0x6042:00 of the device to 1: it is delivered with 2"));
}

TEST(BusAdd, RefusesAnObjectOfAnotherTypeThanItIsMappedAsWithLineAndKey) {
  const auto told = [](const std::string& node, std::uint32_t key, std::uint16_t type) {
    DeviceFile device = made_for(node);
    Entry& entry = device.entries.at(key);
    entry.data_type = type;
    entry.name = "a name";
    entry.type_line = 812;
    const Fit fit = fit_of(device, machine(), node);
    return fit.obstacles.empty() ? "fits" : fit.obstacles.size() > 1 ? "more" : fit.obstacles[0];
  };
  EXPECT_EQ(told("boom_valve", 0x630001, 6),
            "a.eds: line 812: DataType of 0x6300:01 (a name) is 6 (UNSIGNED16); start-up maps it as 3 (INTEGER16)");
  EXPECT_EQ(told("boom_valve", 0x630001, 4),
            "a.eds: line 812: DataType of 0x6300:01 (a name) is 4 (INTEGER32); start-up maps it as 3 (INTEGER16)");
  EXPECT_EQ(told("boom_valve", 0x604100, 9),
            "a.eds: line 812: DataType of 0x6041:00 (a name) is 9; start-up maps it as 6 (UNSIGNED16)");
  EXPECT_EQ(told("tilt", 0x601000, 8),
            "a.eds: line 812: DataType of 0x6010:00 (a name) is 8 (REAL32); start-up maps it as 3 (INTEGER16)");
  EXPECT_EQ(told("enable", 0x620001, 1),
            "a.eds: line 812: DataType of 0x6200:01 (a name) is 1 (BOOLEAN); start-up maps it as 5 (UNSIGNED8)");
  EXPECT_NE(told("boom_head_pressure", 0x913001, 7), "fits");
  EXPECT_EQ(told("boom_encoder", 0x600400, 7), "fits") << "positions are sold with a sign and without";
  EXPECT_EQ(told("boom_encoder", 0x600400, 4), "fits");
  EXPECT_NE(told("boom_encoder", 0x600400, 8), "fits");
  EXPECT_NE(told("boom_encoder", 0x600400, 6), "fits");
  DeviceFile without = made_for("boom_valve");
  without.entries.erase(0x630101);
  EXPECT_EQ(fit_of(without, machine(), "boom_valve").obstacles,
            std::vector<std::string>{"start-up maps 0x6301:01, which the device does not have"});
}

TEST(BusAdd, BlamesTheIdWhereAnotherHasIt) {
  for (const auto& [id, whose] :
       {std::pair{machine().bus.valve(1).id, "arm_valve"}, std::pair{machine().bus.controller_id, "the controller"}}) {
    EXPECT_EQ(refused("boom_valve", id, made_for("boom_valve")),
              fmt::format("--id 0x{:02X}: is the id of {} in my.toml", id, whose));
  }
  EXPECT_EQ(refused("boom_valve", machine().bus.valve(0).id, made_for("boom_valve")), "accepted") << "its own";
}

TEST(BusAdd, TakesWhatCanOnlyBeReadWhereItIsAsWantedAndOneGuardOfTwo) {
  DeviceFile tilt = made_for("tilt");
  for (const std::uint32_t key : {0x180001U, 0x1A0000U, 0x1A0001U}) tilt.entries[key].access = Access::kReadOnly;
  tilt.entries[0x1A0000].value = Value{2, false};  // more than is wanted
  EXPECT_TRUE(fit_of(tilt, machine(), "tilt").obstacles.empty());
  tilt.entries[0x1A0001].value = Value{0x60200010, false};
  EXPECT_TRUE(tells(fit_of(tilt, machine(), "tilt").obstacles, "start-up writes 0x1800:01"));
  for (const std::uint32_t guard : {0x101601U, 0x140005U}) {
    DeviceFile valve = made_for("boom_valve");
    valve.entries.erase(guard);
    EXPECT_TRUE(fit_of(valve, machine(), "boom_valve").obstacles.empty()) << guard;
  }
}

TEST(BusAdd, TakesATiltSensorOfTwoAxesAsItIsDeliveredForEither) {
  for (const std::string channel : {"1", "2"}) {
    const std::string shipped = solar(), from = "{ 1 = \"slope\" }", to = "{ " + channel + " = \"slope\" }";
    const std::string text = std::string(shipped).replace(shipped.find(from), from.size(), to);
    const auto fit = [&text](const DeviceFile& device) {
      return fit_of(device, parse_machine(with_device(text, "my.toml", "tilt", 0x38, device), "my.toml"), "tilt");
    };
    DeviceFile tilt = made_for("tilt");
    tilt.entries[0x602000] = tilt.entries[0x601000];
    tilt.entries[0x1A0000].value = Value{2, false};
    tilt.entries[0x1A0002] = tilt.entries[0x1A0001];
    tilt.entries[0x1A0002].value = Value{0x60200010, false};
    for (const std::uint32_t key : {0x180001U, 0x1A0000U, 0x1A0001U, 0x1A0002U})
      tilt.entries[key].access = Access::kReadOnly;
    EXPECT_TRUE(fit(tilt).obstacles.empty()) << channel;
    tilt.entries.erase(0x1A0002);
    EXPECT_EQ(fit(tilt).obstacles.empty(), channel == "1") << "an entry is missing";
  }
}

/// `text` with `from`, which is there, replaced.
std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}
std::string all_replaced(std::string text, const std::string& from, const std::string& to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}
/// A device in which a PDO of the node has this identifier and cannot be moved.
DeviceFile with_fixed(DeviceFile device, std::uint32_t cob_id, std::int64_t frame) {
  device.entries[cob_id].access = Access::kReadOnly;
  device.entries[cob_id].value = Value{frame, true};
  return device;
}
std::string block_of(const std::string& text, const std::string& name) {
  const auto begin = text.rfind("[[bus.node]]", text.find("name = \"" + name + '"'));
  return text.substr(begin, text.find("\n\n", begin) + 1 - begin);
}

TEST(BusAddToNodeTables, ChangesWhatDependsOnTheDeviceInTheTableOfTheNodeAndNothingElse) {
  const std::string before = replaced(replaced(solar(), "id = 0x11", "id = 0x11      # its switches: 2"),
                                      "name = \"arm_valve\"", "# Behind the cab.\nname = \"arm_valve\"  # mine");
  const std::string text = with_device(before, "my.toml", "arm_valve", 0x50, made_for("arm_valve"));
  EXPECT_EQ(block_of(text, "arm_valve"),
            "[[bus.node]]\n# Behind the cab.\nname = \"arm_valve\"  # mine\nprofile = \"cia408\"\n"
            "channels = { 1 = \"arm_spool\" }\nid = 0x50      # its switches: 2\ndevice_type = 0x198\n"
            "vendor = 0x1234\nproduct = 0x5678\n");
  EXPECT_EQ(replaced(text, block_of(text, "arm_valve"), block_of(before, "arm_valve")), before);
}

TEST(BusAddToNodeTables, FindsTheKeysInAnyOrderAndTheNodeByItsSignalAndKeepsLineEnds) {
  for (const std::string end : {"\n", "\r\n"}) {
    std::string text = solar();
    const std::string block =
        "[[bus.node]]\nproduct = 1\nchannels.1 = \"slope\"\nvendor = 0x02\nid = 56\n"
        "name = 'inclination'\nprofile = \"cia410\"\ndevice_type = 0x019A\n";
    text = replaced(text, block_of(text, "tilt"), block);
    std::string wanted = replaced(text, block,
                                  "[[bus.node]]\nproduct = 0x5678\nchannels.1 = \"slope\"\nvendor = 0x1234\n"
                                  "id = 0x39\nname = 'inclination'\nprofile = \"cia410\"\ndevice_type = 0x19A\n");
    for (std::string* one : {&text, &wanted})
      if (end != "\n") *one = all_replaced(*one, "\n", end);
    EXPECT_EQ(with_device(text, "my.toml", "inclination", 0x39, made_for("tilt")), wanted);
    EXPECT_EQ(with_device(text, "my.toml", "slope", 0x39, made_for("tilt")), wanted);
    EXPECT_EQ(with_device(wanted, "my.toml", "slope", 0x39, made_for("tilt")), wanted) << "its own id";
  }
}

TEST(BusAddToNodeTables, WritesTheProfileOfAValveAndTheIdentifiersThatCannotBeMovedAndTakesOutOldOnes) {
  DeviceFile pved = with_fixed(with_fixed(made_for("arm_valve"), 0x180001, 0x280), 0x140001, 0x300);
  pved.vendor = 0x01000019;
  pved.product = 0x53373235;
  const std::string text = with_device(solar(), "my.toml", "arm_valve", 0x11, pved);
  EXPECT_EQ(block_of(text, "arm_valve"),
            "[[bus.node]]\nname = \"arm_valve\"\nprofile = \"cia408/pved\"\nchannels = { 1 = \"arm_spool\" }\n"
            "id = 0x11\ndevice_type = 0x198\nvendor = 0x1000019\nproduct = 0x53373235\ntpdo = 0x291\nrpdo = 0x311\n");
  EXPECT_EQ(with_device(text, "my.toml", "arm_valve", 0x11, pved), text) << "once more";
  EXPECT_EQ(with_device(all_replaced(solar(), "\n", "\r\n"), "my.toml", "arm_valve", 0x11, pved),
            all_replaced(text, "\n", "\r\n"));
  const std::string moved = with_device(text, "my.toml", "arm_valve", 0x13, pved);
  EXPECT_NE(moved.find("\ntpdo = 0x293\nrpdo = 0x313\n"), std::string::npos) << moved;
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
    array += "\n{ " + all_replaced(line, "\n", ", ") + " },";
  }
  text = replaced(text, "controller_id = 1\n", "controller_id = 1\n" + array + "\n]\n\n");
  ASSERT_EQ(parse_machine(text, "my.toml").bus.nodes, machine().bus.nodes);
  EXPECT_EQ(refused("tilt", 0x39, tilt, text), needs);
  EXPECT_NE(refused("boom_valve", 0x39, tilt, solar()).find("must be one of CiA 408"), std::string::npos);
  EXPECT_NE(refused("swing", 0x39, tilt, solar()).find("its nodes: boom_valve"), std::string::npos);
}

TEST(BusAddToNodeTables, OfATransmitterOfManyPressuresEachChannelsObjectsMustBeThere) {
  const MachineDescription few = parse_machine(test::few_nodes_text(), "few.toml");
  const DeviceFile six = made_for("pressures", few);
  EXPECT_TRUE(fit_of(six, few, "pressures").obstacles.empty());
  EXPECT_TRUE(fit_of(six, few, "arm_rod_pressure").obstacles.empty()) << "by the name of a signal";
  for (const int channel : {1, 2, 3, 4, 6, 7}) {
    DeviceFile five = six;
    five.entries.erase(0x613100 + static_cast<std::uint32_t>(channel));
    EXPECT_TRUE(tells(fit_of(five, few, "pressures").obstacles,
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
  EXPECT_NE(text.find("product = 0x5678\ntpdo = 0x1C1\nchannels = "), std::string::npos);
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
  EXPECT_TRUE(tells(fit_of(timers, joined, "valves").obstacles, "it has no guard that start-up knows"));
  const std::string text = with_device(joined.text, "axes.toml", "bucket_spool", 0x11,
                                       with_fixed(with_fixed(three, 0x140201, 0x440), 0x180101, 0x2A0));
  const NodeDescription node = *parse_machine(text, "axes.toml").bus.find("valves");
  EXPECT_EQ(node.id, 0x11);
  EXPECT_EQ(node.channels, joined.bus.find("valves")->channels);
  EXPECT_EQ(node.rpdos, (std::array<std::uint16_t, 4>{0, 0, 0x451, 0}));
  EXPECT_EQ(node.tpdos, (std::array<std::uint16_t, 4>{0, 0x2B1, 0, 0}));
  EXPECT_NE(text.find("tpdo2 = 0x2B1\nrpdo3 = 0x451\n"), std::string::npos) << text;
  const std::string moved = with_device(text, "axes.toml", "valves", 0x12, three);
  EXPECT_EQ(moved.find("rpdo3"), std::string::npos) << "where the device has the usual one";
}

/// The file of a device that fits.
std::string eds_of(const DeviceFile& device) {
  std::string text = "[DeviceInfo]\nVendorName=Maker\nProductName=Slope\n";
  const auto section = [&](std::uint32_t key, const char* access, std::uint32_t value) {
    const auto entry = device.entries.find(key);
    const int type = entry != device.entries.end() && entry->second.data_type != 0 ? entry->second.data_type : 7;
    text += fmt::format("[{:04X}sub{:X}]\nDataType={}\nAccessType={}\nDefaultValue=0x{:X}\n", key >> 8, key & 0xFF,
                        type, access, value);
  };
  section(0x100000, "ro", device.device_type);
  section(0x101801, "ro", device.vendor);
  section(0x101802, "ro", device.product);
  for (const auto& [key, entry] : device.entries)
    if (key >> 8 != 0x1000 && key >> 8 != 0x1018)
      section(key, entry.access == Access::kReadWrite ? "rw" : "ro", entry.value->of(0));
  return text;
}

TEST(BusAddProgram, ChangesTheFileOfADeviceThatFits) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("my.toml"), eds = folder.file("slope.eds");
  std::ofstream(file) << solar();
  std::ofstream(eds) << eds_of(made_for("tilt"));
  const auto run = test::run_program(test::program("knuckle"),
                                     {"bus", "add", eds, "--id", "0x39", "--as", "tilt", "--machine", file});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("tilt is Maker Slope, node 0x39, in " + file), std::string::npos) << run.out;
  EXPECT_EQ(parse_machine(test::content(file), file).bus.tilt().id, 0x39);
  EXPECT_EQ(test::content(folder.file("my.1.toml")), solar()) << "as it was before";
  const auto again = test::run_program(test::program("knuckle"),
                                       {"bus", "add", eds, "--id", "0x39", "--as", "tilt", "--machine", file});
  EXPECT_NE(again.out.find("nothing changed"), std::string::npos) << again.out;
  EXPECT_FALSE(std::filesystem::exists(folder.file("my.2.toml")));
  const auto stock = test::run_program(test::program("knuckle"),
                                       {"bus", "add", eds, "--id", "0x39", "--as", "tilt", "--machine", "solar015"});
  EXPECT_NE(stock.err.find("--machine solar015: is a machine that comes with Knuckle: copy its file first"),
            std::string::npos)
      << stock.err;
}

TEST(BusAddProgram, LeavesTheFileAsItWasWhereStartUpWouldFail) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("my.toml"), eds = folder.file("tilt.eds");
  std::ofstream(file) << solar();
  DeviceFile tilt = made_for("tilt");
  tilt.entries.erase(0x101700);
  std::ofstream(eds) << eds_of(tilt);
  const auto run = test::run_program(test::program("knuckle"),
                                     {"bus", "add", eds, "--id", "0x38", "--as", "tilt", "--machine", file});
  EXPECT_EQ(run.exit_code, 1) << run.out << run.err;
  EXPECT_NE(run.err.find("0x1017:00, which the device does not have"), std::string::npos) << run.err;
  EXPECT_EQ(test::content(file), solar());
  EXPECT_FALSE(std::filesystem::exists(folder.file("my.1.toml")));
}

TEST(BusProgram, AsksForWhatItsActionNeedsAndRefusesTheRest) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("my.toml");
  std::ofstream(file) << solar();
  const auto said = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "bus");
    const auto run = test::run_program(test::program("knuckle"), arguments);
    EXPECT_EQ(run.exit_code, 2);
    return run.err;
  };
  EXPECT_NE(said({"add", "--machine", file}).find("knuckle: FILE: is required by bus add"), std::string::npos);
  EXPECT_NE(said({"add", "a.eds", "--machine", file}).find("knuckle: --id: is required by bus add"), std::string::npos);
  EXPECT_NE(said({"add", "a.eds", "--id", "3", "--machine", file}).find("--as: is required by"), std::string::npos);
  EXPECT_NE(said({"add", "a.eds", "--id", "3", "--as", "tilt"}).find("--machine: is required by bus add"),
            std::string::npos);
  EXPECT_NE(said({"migrate"}).find("--machine: is required by bus migrate"), std::string::npos);
  EXPECT_NE(said({"migrate", "a.eds", "--machine", file}).find("FILE a.eds: does not go with bus migrate"),
            std::string::npos);
  EXPECT_NE(said({"migrate", "--as", "tilt", "--machine", file}).find("--as tilt: does not go with"),
            std::string::npos);
  EXPECT_EQ(test::content(file), solar());
  struct Case {
    std::vector<std::string> arguments;
    const char* told;
  };
  for (const auto& [arguments, told] :
       {Case{{"--can", "no_such_can"}, "--id: is required by bus assign-id"},
        Case{{"--id", "0x10"}, "--can: is required by bus assign-id"},
        Case{{"--id", "0x80", "--can", "c"}, "--id 0x80: must be a node id, 1 to 127 or 0x01 to 0x7F"},
        Case{{"--id", "0x10", "--can", "c", "--as", "tilt"}, "--as tilt: does not go with bus assign-id"},
        Case{{"--id", "0x10", "--can", "c", "--from", "16"}, "--from 16: is the node id that it is to have"},
        Case{{"--id", "0x10", "--can", "c", "--from", "9", "--serial", "7"}, "--serial: does not go with --from"},
        Case{{"--id", "0x10", "--can", "c", "--by-object", "0x20F0"}, "--by-object 0x20F0: needs --from"},
        Case{{"--id", "0x10", "--can", "c", "--from", "9", "--by-object", "0x1018:04"},
             "--by-object 0x1018:04: must be an object of the device, such as 0x20F0 or 0x20F0:01"},
        Case{{"--id", "1", "--can", "c"}, "--id 1: is the controller's"},
        Case{{"--id", "0x10", "--can", "no_such_can"}, "CAN interface \"no_such_can\": no such interface"}}) {
    std::vector<std::string> all{"assign-id"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const std::string err = said(all);
    EXPECT_NE(err.find(told), std::string::npos) << err;
    EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
  }
}

TEST(BusAdd, FindsNothingAgainstDevicesThatAreSold) {
  if (!std::filesystem::exists(test::source_dir() + "/../shared")) GTEST_SKIP() << "no ../shared";
  for (const auto& [eds, node] : {std::pair{"PVED-CC.eds", "boom_valve"}, std::pair{"DST-X720.eds", "tilt"}}) {
    const Fit fit = fit_of(read_device_file(kDevices + eds), machine(), node);
    EXPECT_TRUE(fit.obstacles.empty()) << node << ": " << fit.obstacles[0];
  }
}

/// The shipped machine with devices that are sold in place of its valves and its tilt sensor.
MachineDescription machine_of_sold_parts(const DeviceFile& valve, const DeviceFile& tilt) {
  std::string text = solar();
  for (const auto& [node, id] : {std::pair{"boom_valve", 0x10}, {"arm_valve", 0x11}, {"bucket_valve", 0x12}})
    text = with_device(text, "my.toml", node, static_cast<std::uint8_t>(id), valve);
  text = with_device(text, "my.toml", "tilt", 0x38, tilt);
  const std::string coarse = "tilt_step_deg = 0.1";
  text.replace(text.find(coarse), coarse.size(), "tilt_step_deg = 0.05");  // as it is delivered
  const std::string controller = "controller_id = 1\n";
  text.replace(text.find(controller), controller.size(), controller + "boot_timeout_ms = 4000\n");
  return parse_machine(text, "my.toml");
}

TEST(SoldDevices, StartAsTheyAreDeliveredAndAgainAfterAFaultWithoutASecondBoot) {
  if (!std::filesystem::exists(test::source_dir() + "/../shared")) GTEST_SKIP() << "no ../shared";
  const DeviceFile valve = read_device_file(kDevices + "PVED-CC.eds"),
                   tilt = read_device_file(kDevices + "DST-X720.eds");
  const MachineDescription machine = machine_of_sold_parts(valve, tilt);
  VirtualCanBus bus(2, machine.bus.bit_rate);
  sim::CanNodes nodes(machine, {}, bus.port(1), 1);
  for (const std::uint8_t id : std::initializer_list<std::uint8_t>{0x10, 0x11, 0x12})
    nodes.node(id)->become(dictionary(valve, id));
  nodes.node(0x38)->become(dictionary(tilt, 0x38));
  for (const NodeDescription& node : machine.bus.nodes) nodes.node(node.id)->set_boot_time(3s);
  slave::CanopenClient client(machine, bus.port(0));
  Time now{1s};
  const auto starts = [&](Duration most) {
    for (const Time end = now + most; now < end && !client.operational();) {
      now += 1ms;
      nodes.step(now, {});
      bus.advance(now);
      if (now.time_since_epoch() % 5ms != 0ms) continue;
      for (CanFrame frame; bus.port(0).receive(frame);) client.receive(frame, now);
      client.begin_step(now);
      client.end_step({}, false, now);
    }
    return client.operational();
  };
  ASSERT_TRUE(starts(6s)) << text(client.fault()) << text(client.setup_failure(), client.bus());
  EXPECT_EQ(nodes.node(0x10)->value(canopen::kRpdo1Timer), 50U) << "its one guard";
  EXPECT_EQ(nodes.node(0x38)->value(canopen::kTpdo1Type), 2U);
  client.restart();
  EXPECT_TRUE(starts(2s)) << text(client.fault()) << text(client.setup_failure(), client.bus());
}

}  // namespace
}  // namespace knuckle::eds
