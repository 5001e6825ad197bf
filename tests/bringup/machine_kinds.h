// Machines whose sensors and commands are frames of their own bus, on one bus or two, from a J1939 address and in
// groups, or whose valves and sensors hang on a module; and what a person answers who commissions them.
#pragma once

#include <ostream>
#include <string>

#include "tests/bringup/commissioned.h"
#include "tests/support/command_machine.h"
#include "tests/support/j1939_machine.h"
#include "tests/support/module_machine.h"
#include "tests/support/two_buses.h"

namespace knuckle::bringup::test {

using knuckle::test::two_buses_text;

/// And readings beside, which are no sensors that a motion is judged by.
inline std::string speeds_text() {
  const std::string readings =
      "[[bus.broadcast]]\nname = \"engine\"\nid = 0x18FF5021\nbytes = 8\nperiod_ms = 20\n[bus.broadcast.signals]\n"
      "engine_speed = { start = 0, bits = 16, scale = 0.125, unit = \"rpm\" }\n"
      "oil_temperature = { start = 16, bits = 8, scale = 1, offset = -40, unit = \"degC\" }\n"
      "engine_hours = { start = 32, bits = 32, scale = 0.05, unit = \"h\" }\n";
  return knuckle::test::command_text(knuckle::test::kRateCommands, knuckle::test::kStateBroadcast + readings);
}
inline std::string pilots_text() {
  return knuckle::test::command_text(knuckle::test::kPilotCommands);
}
/// Valve nodes, beside angles that the machine sends.
inline std::string angles_text() {
  return knuckle::test::broadcast_text();
}
/// An enable node on the first bus, all else on the second.
inline std::string commands_on_second() {
  std::string text = knuckle::test::command_text("", "");
  text.insert(text.find("[[bus.broadcast]]"),
              "[[bus.node]]\nname = \"enable\"\nprofile = \"cia401\"\nid = 0x40\ndevice_type = 0x0191\n"
              "vendor = 0x4B4E\nproduct = 0x0401\nchannels = { 1 = \"machine_enable\" }\n");
  text = knuckle::test::on_two_buses(text);
  return text.insert(text.find("\n[limits]"), "\n" + std::string(knuckle::test::kRateCommands));
}
/// Command frames from an address, angles and the machine's state in groups.
inline std::string j1939_text() {
  std::string text = knuckle::test::command_text(knuckle::test::kRateCommands,
                                                 std::string(knuckle::test::kStateBroadcast) + knuckle::test::kGroups);
  text = with(with(text, "id = 0x18FF1021", "pgn = 0xFF10\nsource = 0x21"), "id = 0x18FF4021", "pgn = 0xFF40");
  return knuckle::test::with_address(text, "0x05");
}
/// The shipped inputs over a whole turn: the stops lie beyond the working range.
inline std::string module_text(const char* outputs) {
  std::string text = knuckle::test::module_text(outputs);
  text = with(text, "low = -0.6, high = 1.2,", "low = -1.6, high = 2.4,");
  text = with(text, "low = -20, high = -160,", "low = 20, high = -200,");
  return with(text, "low = -2.7, high = 0.9,", "low = -3.1, high = 1.9,");
}
inline std::string voltages_text() {
  return module_text(knuckle::test::kVoltageOutputs);
}
inline std::string currents_text() {
  return module_text(knuckle::test::kCurrentOutputs);
}

inline constexpr Words kAngles{.zero = "correct", .angles = true},
    kModule{.zero = "correct", .angles = true, .guards_first = false},
    kSpeeds{.first = "send", .zero = "correct", .angles = true, .guards_first = false, .dead_bands = false};

struct MachineKind {
  const char* name;
  std::string (*text)();
  Words words;
};
inline std::ostream& operator<<(std::ostream& out, const MachineKind& kind) {
  return out << kind.name;
}
inline constexpr MachineKind kMachineKinds[] = {
    {"LedBySpeeds", speeds_text, kSpeeds},
    {"LedByPilots", pilots_text, {.first = "send", .zero = "correct", .angles = true, .guards_first = false}},
    {"ValveNodesBesideItsAngles", angles_text, kAngles},
    {"ValvesOnOneBusAndAnglesOnTheOther", two_buses_text, kAngles},
    {"CommandsOnTheSecondBus",
     commands_on_second,
     {.zero = "correct", .angles = true, .guards_first = false, .dead_bands = false}},
    {"LedFromAnAddressAndByGroups", j1939_text, kSpeeds},
    {"ModuleOfVoltages", voltages_text, kModule},
    {"ModuleOfCurrents", currents_text, kModule}};

}  // namespace knuckle::bringup::test
