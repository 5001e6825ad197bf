// A machine whose pilot valves and sensors hang on a CiA 401 module, beside an enable node: the shipped one in other
// words.
#pragma once

#include <string>

#include "tests/support/keyed_nodes.h"
#include "tests/support/replaced.h"
#include "tests/support/shipped.h"

namespace knuckle::test {

/// Valves fed from half the supply of 12 V, in mV a count; nothing hangs on the fourth.
inline constexpr const char* kVoltageOutputs = R"([bus.node.outputs]
1 = { joint = "boom", unit = "V", scale = 0.001, neutral = 6, extend = 9, retract = 3 }
2 = { joint = "arm", unit = "V", scale = 0.001, neutral = 6, extend = 9, retract = 3 }
3 = { joint = "bucket", unit = "V", scale = 0.001, neutral = 6, extend = 3, retract = 9 }
4 = { scale = 0.001, neutral = 6 }
)";

/// A magnet each way.
inline constexpr const char* kCurrentOutputs = R"([bus.node.outputs]
1 = { joint = "boom", unit = "mA", scale = 0.05, neutral = 0, extend = 700 }
2 = { joint = "boom", unit = "mA", scale = 0.05, neutral = 0, retract = 700 }
3 = { joint = "arm", unit = "mA", scale = 0.05, neutral = 0, extend = 700 }
4 = { joint = "arm", unit = "mA", scale = 0.05, neutral = 0, retract = 700 }
5 = { joint = "bucket", unit = "mA", scale = 0.05, neutral = 0, extend = 700 }
6 = { joint = "bucket", unit = "mA", scale = 0.05, neutral = 0, retract = 700 }
)";

/// Counts over 0 to 20 mA, 0 to 5 V and 0 to 10 V; nothing hangs on the seventh.
inline constexpr const char* kInputs = R"([bus.node.inputs]
1 = { signal = "boom_head_pressure", range = "4-20mA", counts_low = 6553, counts_high = 32767, low = 0, high = 400, unit = "bar" }
2 = { signal = "boom_rod_pressure", range = "4-20mA", counts_low = 6553, counts_high = 32767, low = 0, high = 400, unit = "bar" }
3 = { signal = "arm_head_pressure", range = "4-20mA", counts_low = 6553, counts_high = 32767, low = 0, high = 400, unit = "bar" }
4 = { signal = "arm_rod_pressure", range = "4-20mA", counts_low = 6553, counts_high = 32767, low = 0, high = 400, unit = "bar" }
5 = { signal = "bucket_head_pressure", range = "4-20mA", counts_low = 6000, counts_high = 30000, low = -1, high = 40, unit = "MPa" }
6 = { signal = "bucket_rod_pressure", range = "4-20mA", counts_low = 6000, counts_high = 30000, low = -1, high = 40, unit = "MPa" }
8 = { signal = "boom_angle", range = "0.5-4.5V", counts_low = 3276, counts_high = 29490, low = -0.6, high = 1.2, unit = "rad" }
9 = { signal = "arm_angle", range = "0.5-4.5V", counts_low = 3276, counts_high = 29490, low = -20, high = -160, unit = "deg" }
10 = { signal = "bucket_angle", range = "0.5-4.5V", counts_low = 3276, counts_high = 29490, low = -2.7, high = 0.9, unit = "rad" }
11 = { signal = "slope", range = "0-10V", counts_low = 0, counts_high = 32767, low = -50, high = 50, unit = "deg" }
)";

/// A module beside it, on whose outputs nothing hangs.
inline constexpr const char* kSpareModule = R"([[bus.node]]
name = "spare"
profile = "cia401"
id = 0x42
device_type = 0x00080191
vendor = 0x4B4E
product = 0x0411
error_value_shift = 16
[bus.node.outputs]
1 = { scale = 0.001, neutral = 6 }
)";

/// What the machine's own controller is told where modules move all joints.
inline constexpr const char* kConstants = R"(
[[bus.command]]
name = "engine"
id = 0x18FF0105
bytes = 1
period_ms = 20
send = "always"
[bus.command.fields]
engine_rpm = { start = 0, bits = 8, scale = 10, neutral = 900, led = 1800 }
)";

inline std::string module_text(const std::string& outputs = kVoltageOutputs, const std::string& inputs = kInputs) {
  const std::string nodes =
      "[[bus.node]]\nname = \"enable\"\nprofile = \"cia401\"\nid = 0x40\ndevice_type = 0x0191\n"
      "vendor = 0x4B4E\nproduct = 0x0401\nchannels = { 1 = \"machine_enable\" }\n"
      "[[bus.node]]\nname = \"module\"\nprofile = \"cia401\"\nid = 0x41\ndevice_type = 0x000C0191\n"
      "vendor = 0x4B4E\nproduct = 0x0411\nerror_value_shift = 16\n";
  return with_nodes(shipped_text(), nodes + outputs + inputs);
}

/// With `to` in place of the first `from` of its nodes.
inline MachineDescription module_machine(const std::string& outputs = kVoltageOutputs, const std::string& from = "",
                                         const std::string& to = "") {
  return parse_machine(replaced(module_text(outputs), from, to, "[[bus.node]]"), "m.toml");
}

}  // namespace knuckle::test
