// A machine whose own controller sends the joints' angles, the pressures in steps of 2 bar and the slope, by its own
// clock; valves and enable are CANopen nodes: the shipped one in other words.
#pragma once

#include <string>

#include "tests/support/keyed_nodes.h"
#include "tests/support/replaced.h"
#include "tests/support/shipped.h"

namespace knuckle::test {

inline constexpr const char* kBroadcasts = R"([[bus.broadcast]]
name = "front_angle"
id = 0x18FF1021
bytes = 8
period_ms = 10
[bus.broadcast.signals]
boom_angle = { start = 0, bits = 16, scale = 0.0004, offset = -10, unit = "rad", sign = -1, zero_rad = 0.12 }
arm_angle = { start = 16, bits = 16, scale = 0.0004, offset = -10, unit = "rad" }
bucket_angle = { start = 39, bits = 16, order = "big", type = "signed", scale = 0.01, unit = "deg" }

[[bus.broadcast]]
name = "pressure_1"
id = 0x18FF2021
bytes = 6
period_ms = 10
[bus.broadcast.signals]
boom_head_pressure = { start = 0, bits = 8, scale = 0.2, offset = -10, unit = "MPa", invalid_from = 0xFB }
boom_rod_pressure = { start = 8, bits = 8, scale = 0.2, offset = -10, unit = "MPa", invalid_from = 0xFB }
arm_head_pressure = { start = 16, bits = 8, scale = 0.2, offset = -10, unit = "MPa", invalid_from = 0xFB }
arm_rod_pressure = { start = 24, bits = 8, scale = 0.2, offset = -10, unit = "MPa", invalid_from = 0xFB }
bucket_head_pressure = { start = 32, bits = 8, scale = 0.2, offset = -10, unit = "MPa", invalid_from = 0xFB }
bucket_rod_pressure = { start = 40, bits = 8, scale = 0.2, offset = -10, unit = "MPa", invalid_from = 0xFB }

[[bus.broadcast]]
name = "body"
id = 0x1A5
bytes = 4
period_ms = 20
counter = { start = 16, bits = 4, modulus = 15 }
checksum = { kind = "crc8-j1850", start = 24, bits = 8, data_id = [0x5A] }
[bus.broadcast.signals]
slope = { start = 0, bits = 16, type = "signed", scale = 0.01, unit = "deg" }
)";

/// @param frames in place of kBroadcasts @param with_valves valves and enable; else frames must tell the joints what to
/// do
inline std::string broadcast_text(const std::string& frames = kBroadcasts, bool with_valves = true) {
  std::string text = shipped_text();
  const auto set = [&text](const std::string& key, const std::string& value) {
    const std::size_t at = text.find("\n" + key + " = ") + key.size() + 4;
    text.replace(at, text.find_first_of(" \n", at) - at, value);
  };
  set("sensor_age_limit_ms", "50");
  set("pressure_step_bar", "2");
  set("pressure_range_bar", "350");
  const char* const valve = "profile = \"cia408\"\ndevice_type = 0x0198\nvendor = 0x4B4E\nproduct = 0x0408\n";
  std::string nodes;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const std::string joint = kJointNames[i];
    nodes += "[[bus.node]]\nname = \"" + joint + "_valve\"\nid = 0x1" + std::to_string(i) + "\n" + valve +
             "channels = { 1 = \"" + joint + "_spool\" }\n";
  }
  nodes +=
      "[[bus.node]]\nname = \"enable\"\nprofile = \"cia401\"\nid = 0x40\ndevice_type = 0x0191\n"
      "vendor = 0x4B4E\nproduct = 0x0401\nchannels = { 1 = \"machine_enable\" }\n";
  return with_nodes(text, with_valves ? nodes + frames : frames);
}

/// With `to` in place of the first `from` of its broadcasts.
inline MachineDescription broadcast_machine(const std::string& from = "", const std::string& to = "") {
  return parse_machine(broadcast_text(replaced(kBroadcasts, from, to)), "m.toml");
}

}  // namespace knuckle::test
