// Machines whose own controller sends J1939 parameter groups as well (numbers and scales of SAE J1939-71): engine,
// temperatures, battery, and hours when asked.
#pragma once

#include <string>

#include "tests/support/command_machine.h"

namespace knuckle::test {

inline constexpr const char* kGroups = R"(
[[bus.broadcast]]
name = "engine"
pgn = 0xF004
source = 0x00
bytes = 8
period_ms = 20
[bus.broadcast.signals]
engine_speed = { start = 24, bits = 16, scale = 0.125, unit = "rpm" }
engine_running = { start = 48, bits = 4, on = 0 }

[[bus.broadcast]]
name = "coolant"
pgn = 0xFEEE
bytes = 8
period_ms = 1000
[bus.broadcast.signals]
coolant_temperature = { start = 0, bits = 8, scale = 1, offset = -40, unit = "degC" }

[[bus.broadcast]]
name = "hydraulics"
pgn = 0xFE68
bytes = 8
period_ms = 1000
[bus.broadcast.signals]
oil_temperature = { start = 0, bits = 8, scale = 1, offset = -40, unit = "degC" }

[[bus.broadcast]]
name = "battery"
pgn = 0xFEF7
bytes = 8
period_ms = 1000
[bus.broadcast.signals]
battery_voltage = { start = 32, bits = 16, scale = 0.05, unit = "V" }

[[bus.broadcast]]
name = "hours"
pgn = 0xFEE5
source = 0x00
bytes = 8
request_every_s = 10
[bus.broadcast.signals]
engine_hours = { start = 0, bits = 32, scale = 0.05, unit = "h" }
)";

/// @param text of a machine file
inline std::string with_address(std::string text, const std::string& address) {
  const std::string bus = "\n[bus]";
  const auto at = text.find('\n', text.find(bus) + bus.size());
  return text.insert(at, "\nj1939_address = " + address);
}

/// Valves and enable are nodes; with `to` in place of the first `from` of all that it sends.
inline std::string j1939_text(const std::string& from = "", const std::string& to = "",
                              const std::string& address = "0xF9") {
  std::string broadcasts = kBroadcasts;
  broadcasts += kGroups;
  const std::string text = broadcast_text(replaced(broadcasts, from, to));
  return address.empty() ? text : with_address(text, address);
}
inline MachineDescription j1939_machine(const std::string& from = "", const std::string& to = "") {
  return parse_machine(j1939_text(from, to), "m.toml");
}

/// Coolant temperature and fuel level are in a message of three packets, hours in one of two that must be asked for.
inline std::string packets_text(const std::string& from = "", const std::string& to = "") {
  std::string text = j1939_text();
  const auto replace = [&text](const char* old, const char* by) { text = replaced(text, old, by); };
  replace("pgn = 0xFEEE\nbytes = 8", "pgn = 0x1FF60\nbytes = 20");
  replace("coolant_temperature = { start = 0,",
          "fuel_level = { start = 137, bits = 8, scale = 0.4, unit = \"%\" }\ncoolant_temperature = { start = 52,");
  replace("source = 0x00\nbytes = 8\nrequest_every_s = 10", "source = 0x00\nbytes = 12\nrequest_every_s = 10");
  replace("engine_hours = { start = 0,", "engine_hours = { start = 64,");
  return replaced(text, from, to);
}

/// Without a node; its first command frame goes out from the address.
inline MachineDescription commanded_j1939_machine() {
  return parse_machine(with_address(command_text(kRateCommands, std::string(kStateBroadcast) + kGroups), "0x05"),
                       "m.toml");
}

/// Auxiliary valves of ISO 11783-7; the arm's is mounted the other way round.
inline constexpr const char* kValveCommands = R"([[bus.command]]
iso11783_valve = 3
joint = "boom"
extend = 100
retract = 80

[[bus.command]]
iso11783_valve = 0
joint = "arm"
extend = 90
retract = 100
reversed = true
period_ms = 10

[[bus.command]]
iso11783_valve = 15
joint = "bucket"
extend = 100
retract = 100
)";

/// Without a node, led by these valves from address 0x26; with `to` in place of the first `from` of their commands.
inline std::string valves_text(const std::string& from = "", const std::string& to = "",
                               const std::string& address = "0x26") {
  const std::string text = command_text(replaced(kValveCommands, from, to));
  return address.empty() ? text : with_address(text, address);
}
inline MachineDescription valves_machine() {
  return parse_machine(valves_text(), "m.toml");
}

}  // namespace knuckle::test
