// A machine that is led through its own controller, by frames alone: the shipped one in other words, without a node.
#pragma once

#include <string>

#include "tests/support/broadcast_machine.h"

namespace knuckle::test {

/// Joints' speeds, a field that is not used, and the switch that says that Knuckle leads.
inline constexpr const char* kRateCommands = R"([[bus.command]]
name = "front_rate"
id = 0x18FF0105
bytes = 8
period_ms = 10
send = "always"
[bus.command.fields]
boom_rate = { start = 0, bits = 16, scale = 0.0005, offset = -16, unit = "rad/s", joint = "boom", neutral = 0, extend = 0.6, retract = -0.6 }
arm_rate = { start = 16, bits = 16, scale = 0.0005, offset = -16, unit = "rad/s", joint = "arm", neutral = 0, extend = -0.9, retract = 0.9 }
bucket_rate = { start = 39, bits = 16, order = "big", type = "signed", scale = 0.1, unit = "deg/s", joint = "bucket", neutral = 0, extend = -70, retract = 70 }
slew_rate = { start = 48, bits = 16, scale = 0.0005, offset = -16, neutral = 0 }

[[bus.command]]
name = "setting"
id = 0x1A6
bytes = 8
period_ms = 20
send = "always"
counter = { start = 48, bits = 4, modulus = 15 }
checksum = { kind = "crc8-h2f", start = 56, bits = 8, data_id = [0x21] }
[bus.command.fields]
front_by_bus = { start = 8, bits = 4, neutral = 1, led = 2 }
horn = { start = 16, bits = 2, neutral = 3 }
)";

/// Pilot pressures, a valve each way, sent only while an operator leads.
inline constexpr const char* kPilotCommands = R"([[bus.command]]
name = "pilot_1"
id = 0x18FF0305
bytes = 6
period_ms = 10
send = "while_led"
[bus.command.fields]
boom_up = { start = 0, bits = 8, scale = 0.2, unit = "bar", joint = "boom", neutral = 0, extend = 40 }
boom_down = { start = 8, bits = 8, scale = 0.2, unit = "bar", joint = "boom", neutral = 0, retract = 40 }
arm_in = { start = 16, bits = 8, scale = 0.2, unit = "bar", joint = "arm", neutral = 0, extend = 40 }
arm_out = { start = 24, bits = 8, scale = 0.2, unit = "bar", joint = "arm", neutral = 0, retract = 40 }
bucket_in = { start = 32, bits = 8, scale = 0.2, unit = "bar", joint = "bucket", neutral = 0, extend = 40 }
bucket_out = { start = 40, bits = 8, scale = 0.2, unit = "bar", joint = "bucket", neutral = 0, retract = 40 }
)";

/// Shares of the valves' flow, the way in bits beside them.
inline constexpr const char* kFlowCommands = R"([[bus.command]]
name = "flow_1"
id = 0x18FF0505
bytes = 6
period_ms = 10
send = "while_led"
[bus.command.fields]
boom = { start = 0, bits = 10, scale = 0.1, unit = "%", joint = "boom", neutral = 0, extend = 100, retract = 100, direction = { start = 10, bits = 2, neutral = 0, extend = 1, retract = 2 } }
arm = { start = 16, bits = 10, scale = 0.1, unit = "%", joint = "arm", neutral = 0, extend = 100, retract = 100, direction = { start = 26, bits = 2, neutral = 3, extend = 2, retract = 1 } }
bucket = { start = 32, bits = 10, scale = 0.1, unit = "%", joint = "bucket", neutral = 0, extend = 100, retract = 100, direction = { start = 42, bits = 2, neutral = 0, extend = 1, retract = 2 } }
)";

inline constexpr const char* kStateBroadcast = R"([[bus.broadcast]]
name = "machine_state"
id = 0x18FF4021
bytes = 2
period_ms = 25
counter = { start = 8, bits = 8 }
[bus.broadcast.signals]
pilot_on = { start = 0, bits = 2 }
e_stop_closed = { start = 2, bits = 1, on = 0 }
)";

/// What moves the spools, measured: the dead band of 11 % of the shipped machine, and full stroke, of 4 MPa.
inline constexpr const char* kPilotPressures = R"([[bus.broadcast]]
name = "pilot_pressure"
id = 0x18FF5021
bytes = 6
period_ms = 10
[bus.broadcast.signals]
boom_extend_pilot = { start = 0, bits = 8, scale = 0.02, unit = "MPa", shut = 0.44, full = 4 }
boom_retract_pilot = { start = 8, bits = 8, scale = 0.02, unit = "MPa", shut = 0.44, full = 4 }
arm_extend_pilot = { start = 16, bits = 8, scale = 0.02, unit = "MPa", shut = 0.44, full = 4 }
arm_retract_pilot = { start = 24, bits = 8, scale = 0.02, unit = "MPa", shut = 0.44, full = 4 }
bucket_extend_pilot = { start = 32, bits = 8, scale = 0.02, unit = "MPa", shut = 0.44, full = 4 }
bucket_retract_pilot = { start = 40, bits = 8, scale = 0.02, unit = "MPa", shut = 0.44, full = 4 }
)";

/// The machine's state, and the pressures that move its spools.
inline std::string state_with_pilots() {
  return std::string(kStateBroadcast) + '\n' + kPilotPressures;
}

inline std::string command_text(const std::string& commands = kRateCommands,
                                const std::string& state = kStateBroadcast) {
  return broadcast_text(commands + "\n" + kBroadcasts + "\n" + state, false);
}

/// With `to` in place of the first `from` of its commands.
inline MachineDescription command_machine(const std::string& commands = kRateCommands, const std::string& from = "",
                                          const std::string& to = "") {
  return parse_machine(command_text(replaced(commands, from, to)), "m.toml");
}

}  // namespace knuckle::test
