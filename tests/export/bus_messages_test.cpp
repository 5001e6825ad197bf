// Every frame of the machine's bus as its DBC has it: whole and without contradiction.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "app/export/export_command.h"
#include "machine/bus_description.h"
#include "slave/bus_map.h"
#include "tests/export/machines.h"
#include "tests/support/broadcast_machine.h"
#include "tests/support/bus_nodes.h"
#include "tests/support/j1939_machine.h"
#include "tests/support/says.h"
#include "tests/support/two_buses.h"
#include "transport/canopen.h"

namespace knuckle::exporting {
namespace {

using test::machines_of_every_wire;

TEST(BusMessages, AreEveryFrameOfTheMapWithItsRateAndSize) {
  for (const MachineDescription& machine : machines_of_every_wire()) {
    std::map<std::uint32_t, Message> periodic;
    for (const Message& message : bus_messages(machine)) {
      if (message.period_s) periodic[message.id] = message;
    }
    const auto map = slave::bus_map(machine.bus);
    EXPECT_EQ(periodic.size(), map.size());
    for (const PeriodicFrame& frame : map) {
      ASSERT_TRUE(periodic.contains(frame.id)) << machine.name << " " << frame.id;
      EXPECT_EQ(periodic[frame.id].size, frame.size);
      EXPECT_DOUBLE_EQ(*periodic[frame.id].period_s, 1 / frame.rate_Hz);
    }
  }
}

TEST(BusMessages, AreWhatTheControllerHearsAndWhatItTells) {
  for (const MachineDescription& machine : machines_of_every_wire()) {
    std::set<std::uint32_t> heard, told;
    for (const Message& message : bus_messages(machine))
      EXPECT_TRUE((message.sender == kController ? told : heard).insert(message.id).second)
          << "twice: " << message.name;
    // It also listens for what only it may say: whoever else says it is foreign.
    const auto ids = slave::heard_by_controller(machine.bus);
    std::set<std::uint32_t> all = heard;
    all.insert(told.begin(), told.end());
    std::set<std::uint32_t> filters;
    for (const CanFilter& filter : ids) filters.insert(filter.id);
    EXPECT_EQ(all, filters) << machine.name;
    std::set<std::uint32_t> expected{canopen::kNmtId, canopen::kSyncId,
                                     canopen::heartbeat_id(machine.bus.controller_id), machine.bus.enable().rpdo_id()};
    for (int joint = 0; joint < kJoints; ++joint) expected.insert(machine.bus.set_point_id(joint));
    for (const NodeDescription& node : machine.bus.nodes) expected.insert(canopen::sdo_request_id(node.id));
    EXPECT_EQ(told, expected) << machine.name;
  }
}

TEST(BusMessages, RangesAreWhatTheSensorsAreBelievedIn) {
  const MachineDescription machine = calibrated(test::calibrated_machine());
  for (const Message& message : bus_messages(machine)) {
    for (const Signal& signal : message.signals) {
      EXPECT_LT(signal.min, signal.max) << message.name << " " << signal.name;
      EXPECT_TRUE(std::isfinite(signal.min) && std::isfinite(signal.max)) << message.name << " " << signal.name;
      if (message.name == "boom_rod_pressure_TPDO1" && signal.name == "Pressure") {
        EXPECT_DOUBLE_EQ(signal.min, -3);
        EXPECT_DOUBLE_EQ(signal.max, 1.05 * 400);
      }
      if (message.name == "arm_encoder_TPDO1" && signal.name == "Length") {  // offset -2 mm, 10 mm to spare
        EXPECT_DOUBLE_EQ(signal.min, 875 - 10 - 2);
        EXPECT_DOUBLE_EQ(signal.max, 1345 + 10 - 2);
      }
    }
  }
}

std::string dbc_of(const MachineDescription& machine) {
  std::ostringstream dbc;
  write_dbc(machine, dbc);
  return dbc.str();
}

TEST(BusMessages, SignalsFitIntoTheirFramesAndNamesAreUniqueAndNoLongerThanDbcAllows) {
  for (const MachineDescription& machine : machines_of_every_wire()) {
    std::set<std::string> names;
    for (const Message& message : bus_messages(machine)) {
      EXPECT_LE(message.name.size(), 32U) << message.name;
      EXPECT_TRUE(names.insert(message.name).second) << message.name;
      std::set<unsigned> bits;
      for (const Signal& signal : message.signals) {
        EXPECT_LE(signal.start_bit + signal.bits, 8U * message.size) << message.name << " " << signal.name;
        for (unsigned bit = 0; bit < signal.bits; ++bit)
          EXPECT_TRUE(bits.insert(signal.start_bit + bit).second) << message.name << " " << signal.name;
      }
    }
  }
}

/// Identifiers of 29 bits have bit 31.
TEST(Dbc, SaysOfEachKindOfBusWhatReadersOfItNeed) {
  MachineDescription quoted = test::shipped("solar015"), fast = test::shipped("compact080");
  quoted.name = "the \"big\" one\\";
  fast.bus.sync_Hz = 400;
  struct Said {
    MachineDescription machine;
    std::vector<const char*> lines, not_said;
  };
  const std::vector<Said> all{
      {quoted, {"CM_ \"CANopen bus of the 'big' one/. Written by knuckle "}, {"SIG_VALTYPE_"}},
      // What is no whole number of milliseconds is in the comments only.
      {fast,
       {"every 2.5 ms in operation", "BA_ \"GenMsgCycleTime\" BO_ 1793 50;"},
       {"BA_ \"GenMsgCycleTime\" BO_ 128 "}},
      {test::j1939_machine(),
       {"BA_DEF_ BO_ \"VFrameFormat\" ENUM \"StandardCAN\"", "BO_ 2566844158 coolant: 8 machine_controller",
        "BA_ \"VFrameFormat\" BO_ 2566844158 3;", "BA_ \"VFrameFormat\" BO_ 2565866496 3;",
        " SG_ coolant_temperature : 0|8@1+ (1,-40) [0|0] \"degC\""},
       {}},
      {parse_machine(test::packets_text(), "m.toml"),
       {"BO_ 2583650558 coolant: 20 machine_controller", " SG_ fuel_level : 137|8@1+ (0.4,0)",
        " SG_ coolant_temperature : 52|8@1+ (1,-40)", "BA_ \"VFrameFormat\" BO_ 2583650558 3;",
        "BA_ \"GenMsgCycleTime\" BO_ 2583650558 1000;"},
       {}},
      {test::valves_machine(),
       {"BO_ 2365468710 iso11783_valve_0: 8 controller", " SG_ arm_flow : 0|8@1+ (0.4,0)",
        " SG_ arm_flow_way : 16|4@1+ (1,0)", "VAL_ 2365468710 arm_flow_way 0 \"neutral\" 2 \"extends\" 1 \"retracts\""},
       {}},
      {test::broadcast_machine(),
       {"BO_ 2566852641 front_angle: 8 machine_controller\n",
        " SG_ boom_angle : 0|16@1+ (-0.0004,10.12) [0|0] \"rad\" controller\n",
        " SG_ bucket_angle : 39|16@0- (0.000174532925,0) [0|0] \"rad\" controller\n",
        " SG_ arm_rod_pressure : 24|8@1+ (2,-100) [0|0] \"bar\" controller\n", "BO_ 421 body: 4 machine_controller\n",
        " SG_ counter : 16|4@1+ (1,0) [0|15] \"\" controller\n", "BA_ \"GenMsgCycleTime\" BO_ 421 20;\n",
        " enable machine_controller\n"},
       {"VFrameFormat"}}};
  for (const Said& one : all) {
    const std::string dbc = dbc_of(one.machine);
    for (const char* line : one.lines) EXPECT_TRUE(test::says(dbc, line));
    for (const char* line : one.not_said) EXPECT_FALSE(test::says(dbc, line));
  }
}

TEST(Dbc, FloatsAreToldFromIntegersAndAreOfSinglePrecision) {
  const MachineDescription machine = test::other_wire();
  for (const NodeDescription& node : test::nodes_with(machine.bus, NodeRole::kPressure))
    EXPECT_TRUE(test::says(dbc_of(machine), "SIG_VALTYPE_ " + std::to_string(node.tpdo_id()) + " Pressure : 1;\n"));
}

TEST(Dbc, OfTwoBusesHasTheOne) {
  MachineDescription machine = parse_machine(knuckle::test::two_buses_text(), "m.toml");
  const BusDescription both = machine.bus;
  machine.bus = both.alone(0);
  const std::string valves = dbc_of(machine);
  machine.bus = both.alone(1);
  const std::string second = dbc_of(machine);
  for (const char* line : {"BO_ 400 body: 4 machine_controller\n", "BU_: controller machine_controller\n",
                           "CM_ \"Bus machine of ", "BA_ \"Baudrate\" 250000;"})
    EXPECT_TRUE(test::says(second, line));
  EXPECT_FALSE(test::says(second, "SYNC"));
  EXPECT_TRUE(test::says(valves, "BO_ 400 boom_valve_TPDO1: 4 boom_valve\n")) << "0x190 as well";
  EXPECT_FALSE(test::says(valves, "machine_controller"));
}

}  // namespace
}  // namespace knuckle::exporting
