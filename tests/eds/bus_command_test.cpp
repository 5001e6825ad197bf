// `knuckle bus add`: a machine file with a device that is sold, or why it cannot be.
#include "app/eds/bus_command.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "machine/load.h"
#include "slave/node_setup.h"
#include "tests/eds/bus_program.h"
#include "tests/eds/made_device.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::eds {
namespace {

using test::keyed;
using test::machine;
using test::made_for;
using test::refused;
using test::says;
using test::shipped_text;

TEST(BusAdd, KeepsTheIdentifierOfAPdoThatCannotBeMoved) {
  for (const auto& [first, kept] : {std::pair{0x280, 0x2B8}, {0x180, 0}}) {
    const DeviceFile device = test::with_fixed(made_for("tilt"), 0x180001, first);
    EXPECT_EQ(parse_machine(with_device(shipped_text(), "m", "tilt", 0x38, device), "m").bus.tilt().tpdos[0], kept);
  }
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
  set_map(device, 0, {0x60100010});
  EXPECT_TRUE(parse_machine(with_device(shipped_text(), "m", "tilt", 0x38, device), "m").bus.tilt().tpdo_maps.empty());
  set_map(device, 0, {0x60200010, 0x60100010});
  const std::string text = with_device(shipped_text(), "m", "tilt", 0x38, device);
  EXPECT_TRUE(says(text, "tpdo_map = [0x60200010, 0x60100010]"));
  const MachineDescription after = parse_machine(text, "m");
  EXPECT_EQ(after.bus.tilt().tpdo_maps, (std::vector<std::vector<std::uint32_t>>{{0x60200010, 0x60100010}}));
  EXPECT_TRUE(fit_of(device, after, "tilt").obstacles.empty());
  // The next device in its place leaves none of it behind.
  EXPECT_FALSE(says(with_device(text, "m", "tilt", 0x38, made_for("tilt")), "tpdo_map"));
  set_map(device, 0, {0x60200010});
  EXPECT_TRUE(says(refused("tilt", 0x38, device), "must have 0x60100010"));
}

TEST(BusAdd, OfFourMappingsThatCannotBeChangedTakesThoseThatMapSomething) {
  DeviceFile device = made_for("tilt");
  set_map(device, 0, {0x60100010});
  for (const std::uint32_t pdo : {1U, 2U, 3U}) set_map(device, pdo, {});
  const auto added = [&] { return with_device(shipped_text(), "m", "tilt", 0x38, device); };
  EXPECT_FALSE(says(added(), "_map = ")) << "as start-up wants it";
  set_map(device, 0, {0x60200010, 0x60100010});
  EXPECT_TRUE(says(added(), "tpdo_map = [0x60200010, 0x60100010]"));
  EXPECT_FALSE(says(added(), "tpdo2_map"));
  EXPECT_TRUE(fit_of(device, parse_machine(added(), "m"), "tilt").obstacles.empty());
  for (const std::uint32_t count : {9U, 0xFEU}) {  // from 0xFE on they are no lists
    device.entries[0x1A0100].value = Value{count, false};
    EXPECT_TRUE(says(added(), "tpdo_map = [0x60200010, 0x60100010]")) << count;
    EXPECT_FALSE(says(added(), "tpdo2_map")) << count;
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
    const std::string text = with_device(shipped_text(), "m", "tilt", 0x38, device);
    EXPECT_FALSE(says(text, "_map = "));
    EXPECT_TRUE(says(fit_of(device, parse_machine(text, "m"), "tilt").obstacles, "which can only be read"));
  }
}

TEST(BusAdd, RefusesWhatIsNoMachineFileAfterwards) {
  const DeviceFile valve = made_for("boom_valve");
  EXPECT_TRUE(says(refused("swing_valve", 0x11, valve), "has no node 'swing_valve'; its nodes: boom_valve"));
  EXPECT_EQ(refused("tilt", 0x38, valve),
            "a.eds: 0x1000:00 = 0x198: is a device of CiA 408; tilt must be one of CiA 410");
  DeviceFile of_no_profile = made_for("tilt");
  of_no_profile.device_type = 0x80000;
  EXPECT_EQ(refused("tilt", 0x38, of_no_profile), "accepted");
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
  EXPECT_TRUE(says(fit.obstacles, "the bus has 500 kbit/s"));
  EXPECT_TRUE(says(fit.obstacles, "start-up reads 0x1017:00, which the device does not have"));
  EXPECT_TRUE(says(fit.obstacles, "start-up writes 0x1800:02, which can only be read"));
  EXPECT_TRUE(says(fit.obstacles, "without its controller it would not stop"));
  EXPECT_TRUE(says(fit.obstacles, "0x6042:00 must be 1 and is always 2"));
  device.entries[0x604200].access = Access::kReadWrite;
  EXPECT_TRUE(
      says(fit_of(device, machine(), "boom_valve").to_set, "set 0x6042:00 of the device to 1: it is delivered with 2"));
}

TEST(BusAdd, TakesASensorsOwnTimerWhereItsTransmissionTypeCannotBeChanged) {
  DeviceFile device = made_for("boom_head_pressure");
  device.entries[0x180002].access = Access::kReadOnly;
  device.entries[0x180002].value = Value{254, false};
  Entry& timer = device.entries[0x180005];
  const auto obstacles = [&](std::uint32_t ms, Access access) {
    timer.access = access;
    timer.value = Value{ms, false};
    return fit_of(device, machine(), "boom_head_pressure").obstacles;
  };
  EXPECT_TRUE(obstacles(10, Access::kReadOnly).empty());
  EXPECT_TRUE(obstacles(100, Access::kReadWrite).empty());
  EXPECT_TRUE(says(obstacles(100, Access::kReadOnly),
                   "0x1800:05 must be 5 ms to 20 ms (sync_Hz, sensor_age_limit_ms) and is always 100 ms"));
  device.entries[0x180002].value = Value{3, false};
  EXPECT_TRUE(says(obstacles(10, Access::kReadOnly), "start-up writes 0x1800:02, which can only be read"));
  device.entries[0x180002].value = Value{1, false};
  EXPECT_TRUE(obstacles(100, Access::kReadOnly).empty()) << "it is not used";
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
  EXPECT_TRUE(says(fit_of(tilt, machine(), "tilt").obstacles, "start-up writes 0x1800:01"));
  for (const std::uint32_t guard : {0x101601U, 0x140005U}) {
    DeviceFile valve = made_for("boom_valve");
    valve.entries.erase(guard);
    EXPECT_TRUE(fit_of(valve, machine(), "boom_valve").obstacles.empty()) << guard;
  }
}

TEST(BusAdd, TakesATiltSensorOfTwoAxesAsItIsDeliveredForEither) {
  for (const std::string channel : {"1", "2"}) {
    const std::string shipped = shipped_text(), from = "{ 1 = \"slope\" }", to = "{ " + channel + " = \"slope\" }";
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

/// The program in a folder with the shipped machine's file and a device's.
struct BusAddProgram : ::testing::Test {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("my.toml"), eds = folder.file("tilt.eds");

  test::ProgramRun add(const DeviceFile& device, const std::string& machine) const {
    std::ofstream(eds) << test::eds_text(device);
    return test::run_bus({"add", eds, "--id", "0x39", "--as", "tilt", "--machine", machine});
  }
  void SetUp() override { std::ofstream(file) << shipped_text(); }
};

TEST_F(BusAddProgram, ChangesTheFileOfADeviceThatFits) {
  const auto run = add(made_for("tilt"), file);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(says(run.out, "tilt is Maker Device, node 0x39, in " + file));
  EXPECT_EQ(parse_machine(test::content(file), file).bus.tilt().id, 0x39);
  EXPECT_EQ(test::content(folder.file("my.1.toml")), shipped_text()) << "as it was before";
  const auto again = add(made_for("tilt"), file);
  EXPECT_TRUE(says(again.out, "nothing changed"));
  EXPECT_FALSE(std::filesystem::exists(folder.file("my.2.toml")));
  std::ofstream(file) << keyed();
  EXPECT_TRUE(
      says(add(made_for("tilt"), file).out, "note: " + file + ": its nodes are [[bus.node]] tables from now on\n"));
  EXPECT_EQ(test::content(folder.file("my.2.toml")), keyed());
  const auto stock = add(made_for("tilt"), "solar015");
  EXPECT_TRUE(says(stock.err, "--machine solar015: is a machine that comes with Knuckle: copy its file first"));
}

TEST_F(BusAddProgram, LeavesTheFileAsItWasWhereStartUpWouldFail) {
  DeviceFile tilt = made_for("tilt");
  tilt.entries.erase(0x101700);
  for (const std::string& before : {shipped_text(), keyed()}) {
    std::ofstream(file) << before;
    const auto run = add(tilt, file);
    EXPECT_EQ(run.exit_code, 2) << run.out << run.err;
    EXPECT_TRUE(says(run.err, "0x1017:00, which the device does not have"));
    EXPECT_FALSE(says(run.out, "from now on")) << run.out;
    EXPECT_EQ(test::content(file), before);
    EXPECT_FALSE(std::filesystem::exists(folder.file("my.1.toml")));
  }
}

TEST_F(BusAddProgram, SaysThatTheFileIsChangedWhereNobodyCanReadTheRest) {
  std::ofstream(eds) << test::eds_text(made_for("tilt"));
  const auto run = test::run_program("/bin/sh", {"-c", test::program("knuckle") + " bus add " + eds +
                                                           " --id 0x39 --as tilt --machine " + file + " > /dev/full"});
  EXPECT_EQ(run.exit_code, 2) << run.err;
  EXPECT_TRUE(says(run.err, "standard output: cannot be written; " + file + " has been changed (before: "));
  EXPECT_EQ(load_machine(file).bus.tilt().id, 0x39);
}

TEST(BusProgram, AsksForWhatItsActionNeedsAndRefusesTheRest) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("my.toml");
  std::ofstream(file) << shipped_text();
  struct Case {
    std::vector<std::string> arguments;
    const char* told;
  };
  for (const auto& [arguments, told] : {
           Case{{"add", "--machine", file}, "FILE: is required by bus add"},
           {{"add", "a.eds", "--machine", file}, "--id: is required by bus add"},
           {{"add", "a.eds", "--id", "3", "--machine", file}, "--as: is required by"},
           {{"add", "a.eds", "--id", "3", "--as", "tilt"}, "--machine: is required by bus add"},
           {{"import", "a.dbc", "--machine", file, "--bus", "a"}, "--signal: is required by bus import, or --command"},
           {{"migrate"}, "--machine: is required by bus migrate"},
           {{"migrate", "a.eds", "--machine", file}, "FILE a.eds: does not go with bus migrate"},
           {{"migrate", "--as", "tilt", "--machine", file}, "--as tilt: does not go with"},
           {{"assign-id", "--can", "no_such_can"}, "--id: is required by bus assign-id"},
           {{"assign-id", "--id", "0x10"}, "--can: is required by bus assign-id"},
           {{"assign-id", "--id", "0x80", "--can", "c"}, "--id 0x80: must be a node id, 1 to 127 or 0x01 to 0x7F"},
           {{"assign-id", "--id", "0x10", "--can", "c", "--as", "tilt"}, "--as tilt: does not go with bus assign-id"},
           {{"assign-id", "--id", "0x10", "--can", "c", "--from", "16"},
            "--from 16: is the node id that it is to have"},
           {{"assign-id", "--id", "0x10", "--can", "c", "--from", "9", "--serial", "7"},
            "--serial: does not go with --from"},
           {{"assign-id", "--id", "0x10", "--can", "c", "--by-object", "0x20F0"}, "--by-object 0x20F0: needs --from"},
           {{"assign-id", "--id", "0x10", "--can", "c", "--from", "9", "--by-object", "0x1018:04"},
            "--by-object 0x1018:04: must be an object of the device, such as 0x20F0 or 0x20F0:01"},
           {{"assign-id", "--id", "1", "--can", "c"}, "--id 1: is the controller's"},
           {{"assign-id", "--id", "0x10", "--can", "no_such_can"}, "CAN interface \"no_such_can\": no such interface"},
       }) {
    const auto run = test::run_bus(arguments);
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_TRUE(says(run.err, told));
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  }
  EXPECT_EQ(test::content(file), shipped_text());
}

}  // namespace
}  // namespace knuckle::eds
