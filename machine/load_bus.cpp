// [bus] of a machine file: its rates and limits; and what commissioning has kept of guards.
#include "machine/load_bus.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/units.h"
#include "machine/bus_budget.h"
#include "machine/load_broadcasts.h"
#include "machine/load_bus_lines.h"
#include "machine/load_commands.h"
#include "machine/load_frames.h"
#include "machine/load_nodes.h"
#include "machine/reason_text.h"
#include "transport/j1939.h"

namespace knuckle {
namespace {

constexpr int kPvedMostStroke = 32766;

/// Whether nothing is wrong with what says which frames the nodes send.
bool frames_are_known(const TomlTable& file, const std::vector<NodeDescription>& nodes) {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (const char* key : {"profile", "channels", "tpdo_map", "tpdo2_map", "tpdo3_map", "tpdo4_map"})
      if (!file.sound({fmt::format("node[{}].{}", i, key)})) return false;
    if (!file.sound({"nodes." + nodes[i].name + ".profile"})) return false;
  }
  return true;
}

/// All optional: what the default profiles say where it is absent.
WireDescription read_wire(TomlTable file) {
  WireDescription wire;
  if (file.has("valve_full_stroke")) wire.valve_full_stroke = file.number("valve_full_stroke", 100, 32767);
  using Pressure = WireDescription::Pressure;
  if (file.has("pressure_value"))
    wire.pressure = static_cast<Pressure>(file.choice("pressure_value", {"integer", "float", "integer16"}));
  if (file.has("pressure_digits")) {
    wire.pressure_digits = static_cast<int>(file.integer("pressure_digits", 0, 4));
    file.require(wire.pressure != Pressure::kFloat, "pressure_digits",
                 "only goes with pressure_value = \"integer\" or \"integer16\"", {"pressure_value"});
  }
  if (file.has("encoder_speed_step_mmps"))
    wire.encoder_speed_step_mps = file.number("encoder_speed_step_mmps", 0.01, 10, kMilli);
  return wire;
}

void read_patience(TomlTable& file, BusDescription& bus) {
  const auto optional = [&file](const char* key, double most_ms, double& seconds) {
    if (file.has(key)) seconds = file.number(key, 10, most_ms, kMilli);
  };
  optional("sdo_timeout_ms", 5000, bus.sdo_timeout_s);
  optional("boot_timeout_ms", 30000, bus.boot_timeout_s);
  optional("start_timeout_ms", 30000, bus.start_timeout_s);
  optional("activate_timeout_ms", 30000, bus.activate_timeout_s);
}

/// @param nodes whether what is said of nodes alone must be there.
void read_times(TomlTable& file, bool nodes, BusDescription& bus) {
  bus.sync_Hz = file.number("sync_Hz", 50, 250);
  const double period_ms = 1e3 / bus.sync_Hz;
  file.require(std::abs(period_ms - std::round(period_ms)) < 1e-6, "sync_Hz", "its period must be whole milliseconds");
  const auto wanted = [&file, nodes](const char* key) { return nodes || file.has(key); };
  const auto every_nth = [&](const char* key) { return wanted(key) ? static_cast<int>(file.integer(key, 1, 8)) : 1; };
  bus.set_point_every_nth_sync = every_nth("set_point_every_nth_sync");
  bus.valve_status_every_nth_sync = every_nth("valve_status_every_nth_sync");
  bus.tilt_every_nth_sync = every_nth("tilt_every_nth_sync");
  const auto heartbeat = [&](const char* key, double& period_s) {
    if (wanted(key)) period_s = file.number(key, 10, 500, kMilli);
  };
  heartbeat("controller_heartbeat_ms", bus.controller_heartbeat_s);
  heartbeat("node_heartbeat_ms", bus.node_heartbeat_s);
  const auto at_least = [&file](const char* key, double twice_ms, const std::string& what, TomlTable::Keys of,
                                double most_ms = 2000) {
    const double ms = file.number(key, 1, most_ms);
    file.require(ms >= 2 * twice_ms, key, "must be at least " + number_text(2 * twice_ms) + ", twice the " + what, of);
    return ms * kMilli;
  };
  if (wanted("node_heartbeat_timeout_ms"))
    bus.node_heartbeat_timeout_s = at_least("node_heartbeat_timeout_ms", bus.node_heartbeat_s / kMilli,
                                            "nodes' heartbeat period", {"node_heartbeat_ms"});
  bus.valve_watchdog_s = at_least("valve_watchdog_ms", period_ms * bus.set_point_every_nth_sync,
                                  "valves' command period", {"sync_Hz", "set_point_every_nth_sync"}, kLongestBlind_ms);
  if (wanted("controller_timeout_ms"))
    bus.controller_timeout_s = at_least("controller_timeout_ms", bus.controller_heartbeat_s / kMilli,
                                        "controller's heartbeat period", {"controller_heartbeat_ms"});
  bus.sensor_age_limit_s = at_least("sensor_age_limit_ms", nodes ? period_ms * bus.tilt_every_nth_sync : 0,
                                    "tilt sensor's period", {"sync_Hz", "tilt_every_nth_sync"}, kLongestBlind_ms);
  read_patience(file, bus);
}

/// It must be used, and of two buses on one.
void check_address(const TomlTable& file, const BusDescription& bus) {
  bool asks = false, apart = false;
  const auto elsewhere = [&bus](std::uint32_t id) { return (id & kSecondBus) != bus.j1939_line(); };
  for (const BroadcastFrame& frame : bus.broadcasts) {
    asks = asks || frame.on_request;
    apart = apart || (frame.on_request && elsewhere(frame.id));
  }
  for (const CommandFrame& frame : bus.commands)
    apart = apart || (frame.mask != CanFilter::kWhole && elsewhere(frame.id));
  file.require(!bus.j1939_address || asks || bus.commands_by_address(), "j1939_address",
               "is used by nothing: no [[bus.broadcast]] has request_every_s, and no [[bus.command]] an id of 29 bits "
               "that ends with it",
               {"broadcast", "command"});
  file.require(!apart, "j1939_address", "is one bus's alone: frames from it, and what it asks for, must be on one",
               {"broadcast", "command"});
}

void check_wire(const TomlTable& file, const BusDescription& bus, const SensorDescription& sensors) {
  const bool floats = std::any_of(bus.nodes.begin(), bus.nodes.end(),
                                  [](const NodeDescription& valve) { return valve.profile == ValveProfile::kPved; });
  file.require(!floats || bus.wire.valve_full_stroke <= kPvedMostStroke, "wire",
               fmt::format("valve_full_stroke must be at most {}: above that a valve of profile cia408/pved floats",
                           kPvedMostStroke));
  const double reach_Pa = std::numeric_limits<std::int16_t>::max() * bus.wire.pressure_unit_Pa();
  file.require(
      bus.wire.pressure != WireDescription::Pressure::kInteger16 || reach_Pa > kOverRange * sensors.pressure_range_Pa,
      "wire",
      "16 bits reach " + number_text(reach_Pa / kBar) + " bar, less than the transmitters: needs fewer pressure_digits",
      {".sensors.pressure_range_bar"});
}

}  // namespace

BusDescription read_bus(std::vector<TomlTable> files, const SensorDescription& sensors) {
  BusDescription bus;
  TomlTable& file = files.front();
  const auto frames = [&files](std::size_t on, const char* key) {
    return on < files.size() && files[on].has(key) ? files[on].tables(key) : std::vector<TomlTable>();
  };
  read_bus_lines(files, bus);
  // What is said of nodes alone may be left away where there are none.
  const bool nodes = file.has("node") || file.has("nodes") ||
                     std::none_of(files.begin(), files.end(), [](const TomlTable& one) { return one.has("command"); });
  read_times(file, nodes, bus);
  if (file.has("wire")) bus.wire = read_wire(file.table("wire"));
  if (nodes || file.has("controller_id"))
    bus.controller_id = static_cast<std::uint8_t>(file.integer("controller_id", 1, 127));
  if (file.has("j1939_address"))
    bus.j1939_address = static_cast<std::uint8_t>(file.integer("j1939_address", 0, j1939::kMostAddress));
  bus.broadcasts = read_broadcasts(frames(0, "broadcast"), frames(1, "broadcast"), bus, sensors);
  read_commands(file, frames(0, "command"), frames(1, "command"), bus);
  check_address(file, bus);
  bus.nodes = read_nodes(file, bus, sensors);
  const bool status = bus.broadcast(NodeRole::kEnable, kEStopClosedIndex).field != nullptr ||
                      bus.broadcast(NodeRole::kEnable, kPilotOnIndex).field != nullptr;
  file.require(!status || (bus.by_frames() && !bus.has_enable()), "broadcast",
               "e_stop_closed and pilot_on do not go with an enable node, which tells both", {"command", "node"});
  check_pilots(file, bus);
  for (std::size_t on = 0; on < bus.lines(); ++on) check_frames_beside_nodes(files[on], bus.alone(on));
  check_wire(file, bus, sensors);
  if (frames_are_known(file, bus.nodes))
    for (std::size_t on = 0; on < bus.lines(); ++on) check_bus_load(files[on], bus.alone(on), sensors);
  return bus;
}

void read_guard_proofs(TomlTable record, BusDescription& bus) {
  for (TomlTable& file : record.tables("guards")) {
    using Changed = GuardProof::Changed;
    const auto number = [&](const char* key) { return static_cast<std::uint32_t>(file.integer(key, 0, 0xFFFFFFFF)); };
    const auto is_now = [&](const char* key, double now_s) {
      constexpr double kMost_ms = 1e5, kSame_s = 1e-6;
      return std::abs(file.number(key, 0, kMost_ms, kMilli) - now_s) < kSame_s;
    };
    GuardProof proof;
    proof.proved = file.boolean("proved");
    proof.date = file.text("date");
    file.leave("seen");
    if (file.has("frames")) {
      const bool watchdog = is_now("valve_watchdog_ms", bus.valve_watchdog_s);
      if (file.text("frames") != commands_text(bus))
        proof.changed = Changed::kChannels;
      else if (!watchdog)
        proof.changed = Changed::kTimes;
      bus.commands_guard = proof;
      continue;
    }
    const std::string name = file.text("node");
    if (file.has("serial")) proof.serial = number("serial");
    const std::uint32_t vendor = number("vendor"), product = number("product");
    const bool recorded = file.has("channels");
    const std::string channels = recorded ? file.text("channels") : "";
    const bool watchdog = recorded && is_now("valve_watchdog_ms", bus.valve_watchdog_s);
    const bool timeout = recorded && is_now("controller_timeout_ms", bus.controller_timeout_s);
    const auto of =
        std::find_if(bus.nodes.begin(), bus.nodes.end(), [&](const NodeDescription& n) { return n.name == name; });
    if (of == bus.nodes.end()) continue;
    if (of->vendor != vendor || of->product != product)
      proof.changed = Changed::kDevice;
    else if (!recorded)
      proof.changed = Changed::kNotRecorded;
    else if (channels != told_channels_text(*of, bus))
      proof.changed = Changed::kChannels;
    else if (!timeout || (of->role != NodeRole::kEnable && !watchdog))
      proof.changed = Changed::kTimes;
    of->guard = proof;
  }
  record.leave_rest();
}

}  // namespace knuckle
