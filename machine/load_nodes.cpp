#include "machine/load_nodes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <utility>

#include "machine/bus_frames.h"
#include "machine/device_profile.h"
#include "machine/load_broadcasts.h"
#include "machine/load_commands.h"
#include "machine/load_frames.h"

namespace knuckle {
namespace {

constexpr std::int64_t kMostSteps = std::int64_t{1} << 31;  // of an encoder: what counts more is broken

/// A word of the DBC format: as a node's name it would end the list of nodes.
bool is_word_of_dbc(const std::string& name) {
  constexpr std::array kWords{"VERSION", "FILTER", "INT", "HEX", "FLOAT", "STRING", "ENUM"};
  const bool capitals = std::none_of(name.begin(), name.end(), [](unsigned char c) { return std::islower(c) != 0; });
  return std::find(kWords.begin(), kWords.end(), name) != kWords.end() || (capitals && name.ends_with('_')) ||
         name.starts_with("Vector__") || name.starts_with("VECTOR__");
}

/// Reads nodes and refuses names, signals and ids of nodes and frames that another has taken.
class NodeReader {
 public:
  /// @param file [bus] @param bus gets the frames of modules.
  NodeReader(const TomlTable& file, BusDescription& bus, const SensorDescription& sensors)
      : file_(file), bus_(bus), sensors_(sensors), ids_{{bus.controller_id, "controller_id"}} {
    for (const BroadcastFrame& frame : bus.broadcasts) {
      frames_.emplace(frame.id, frame.name);
      for (const BroadcastField& field : frame.fields) signals_.emplace(field.signal, frame.name);
    }
    for (const CommandFrame& frame : bus.commands) frames_.emplace(frame.id, frame.name);
  }

  /// [bus.nodes]: a key for each signal.
  std::vector<NodeDescription> read_keyed(TomlTable nodes) {
    std::vector<NodeDescription> all;
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
      if (kSignals[i].is_angle || is_optional(kSignals[i])) continue;
      NodeDescription node;
      node.name = kSignals[i].node;
      node.role = kSignals[i].role;
      node.channels = {{1, static_cast<std::uint8_t>(i)}};
      TomlTable file = nodes.table(node.name);
      if (node.role == NodeRole::kValve && file.has("profile"))
        node.profile = static_cast<ValveProfile>(file.choice("profile", kValveProfileNames));
      read(file, node);
      all.push_back(std::move(node));
    }
    return all;
  }

  /// [[bus.node]], in any order.
  std::vector<NodeDescription> read_listed(std::vector<TomlTable> files) {
    std::vector<NodeDescription> all;
    for (TomlTable& file : files) {
      NodeDescription node;
      node.name = file.text("name");
      const auto same = [&](const NodeDescription& other) { return other.name == node.name; };
      file.require(std::none_of(all.begin(), all.end(), same), "name", "is the name of another node");
      read_profile(file, node);
      if (node.role != NodeRole::kModule) read_channels(file, node);
      check_name(file, node);
      read(file, node);
      all.push_back(std::move(node));
    }
    std::stable_sort(all.begin(), all.end(), [](const NodeDescription& a, const NodeDescription& b) {
      return !a.channels.empty() && (b.channels.empty() || first_signal(a) < first_signal(b));
    });
    return all;
  }

  /// A pressure that is there of a joint that has none; empty where there is none.
  [[nodiscard]] std::string pressure_of(int joint) const {
    for (const auto& [place, node] : signals_)
      if (is_pressure_of(kSignals[place], joint)) return kSignals[place].name;
    return "";
  }

  /// "boom_length or boom_angle, slope"; empty where each signal is some node's.
  [[nodiscard]] std::string missing(int without_pressures) const {
    std::string names;
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
      const std::size_t other = in_place_of(i);
      if (is_pressure_of(kSignals[i], without_pressures) || is_optional(kSignals[i])) continue;
      if (bus_.by_frames() && is_told(kSignals[i])) continue;
      if (other < i || signals_.count(i) + signals_.count(other) > 0) continue;
      names += (names.empty() ? "" : ", ") + std::string(kSignals[i].name);
      if (other != i) names += std::string(" or ") + kSignals[other].name;
    }
    return names;
  }

  /// A valve beside frames that tell the joints what to do; empty where there is none.
  [[nodiscard]] std::string told() const {
    for (const auto& [place, node] : signals_)
      if (bus_.by_frames() && kSignals[place].role == NodeRole::kValve) return node;
    return "";
  }

 private:
  static bool is_told(const SignalInfo& signal) {
    return signal.role == NodeRole::kValve || (signal.role == NodeRole::kEnable && !is_status(signal));
  }

  static bool is_pressure_of(const SignalInfo& signal, int joint) {
    return joint != SensorDescription::kNone && signal.role == NodeRole::kPressure && signal.index / 2 == joint;
  }

  /// The signal that says the same, by another sensor: a joint's length or angle. Itself where there is none.
  static std::size_t in_place_of(std::size_t signal) {
    const SignalInfo& one = kSignals[signal];
    for (std::size_t i = 0; i < kSignals.size(); ++i)
      if (i != signal && kSignals[i].role == one.role && kSignals[i].index == one.index) return i;
    return signal;
  }

  static std::uint8_t first_signal(const NodeDescription& node) {
    return std::min_element(node.channels.begin(), node.channels.end(),
                            [](const NodeChannel& a, const NodeChannel& b) { return a.signal < b.signal; })
        ->signal;
  }

  /// It stands in options, scenarios and a DBC, and must not say that the node is another one.
  static void check_name(TomlTable& file, const NodeDescription& node) {
    constexpr std::size_t kLongest = 22;
    const std::string& name = node.name;
    if (name.empty()) return;  // noted
    file.require(is_plain_name(name, kLongest) && name != "controller", "name",
                 "must be a letter and up to 21 letters, digits and _, and not 'controller'");
    file.require(!is_word_of_dbc(name), "name", "is a word of DBC files, which list the nodes: must be another name");
    const auto is_named = [&](const SignalInfo& signal) { return signal.name == name || signal.node == name; };
    const bool has_one = std::any_of(node.channels.begin(), node.channels.end(),
                                     [&](const NodeChannel& channel) { return is_named(channel.info()); });
    file.require(has_one || std::none_of(kSignals.begin(), kSignals.end(), is_named), "name",
                 "is what Knuckle calls a signal that this node does not have", {"channels", "profile"});
  }

  static void read_profile(TomlTable& file, NodeDescription& node) {
    constexpr std::array kProfiles{"cia408", "cia408/pved", "cia404", "cia406", "cia410", "cia401"};
    constexpr std::array kRoles{NodeRole::kValve,   NodeRole::kValve, NodeRole::kPressure,
                                NodeRole::kEncoder, NodeRole::kTilt,  NodeRole::kEnable};
    const auto profile = static_cast<std::size_t>(file.choice("profile", kProfiles));
    node.role = kRoles[profile];
    if (node.role == NodeRole::kEnable && (file.has("inputs") || file.has("outputs"))) node.role = NodeRole::kModule;
    if (profile == 1) node.profile = ValveProfile::kPved;
  }

  struct ChannelRange {
    int most;
    const char* bound;
  };
  static ChannelRange channels_of(const NodeDescription& node) {
    if (node.role == NodeRole::kValve && node.profile == ValveProfile::kPved)
      return {1, "must be channel 1: a PVED-CC has one axis"};
    if (node.role == NodeRole::kValve)
      return {static_cast<int>(NodeDescription::kMostPdos),
              "must be an axis from 1 to 4: each has PDOs of its own, and a node has 4"};
    if (node.role == NodeRole::kPressure) return {8, "must be a channel from 1 to 8"};
    if (node.role == NodeRole::kTilt) return {2, "must be 1 (longitudinal, 0x6010) or 2 (lateral, 0x6020)"};
    return {1, "must be channel 1"};
  }

  /// channels = { 1 = "boom_head_pressure", 2 = "boom_rod_pressure" }
  void read_channels(TomlTable& file, NodeDescription& node) {
    const ChannelRange range = channels_of(node);
    std::vector<const char*> names;
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
      if (kSignals[i].role != node.role || is_status(kSignals[i])) continue;
      names.push_back(kSignals[i].name);
      places.push_back(i);
    }
    if (!file.sound({"profile"})) {  // which values and keys it may have is not known, then
      file.leave_rest();
      node.channels.push_back({1, static_cast<std::uint8_t>(places[0])});
      return;
    }
    TomlTable channels = file.table("channels");
    std::vector<int> numbers;
    for (const std::string& key : channels.keys()) {
      if (const auto number = channel_number(key)) {
        numbers.push_back(*number);
      } else {
        channels.require(false, key, std::string("unknown key: ") + range.bound);
        channels.leave(key);
      }
    }
    std::sort(numbers.begin(), numbers.end());
    for (const int number : numbers) {
      const std::string key = std::to_string(number);
      const std::size_t place = places[static_cast<std::size_t>(channels.choice(key, names))];
      const bool known = channels.sound({key});
      if (!channels.require(number >= 1 && number <= range.most, key, range.bound)) {
        if (known) signals_.emplace(place, node.name);  // it is not missing, too
        continue;
      }
      if (known) take_signal(channels, key, place, node.name);
      node.channels.push_back({static_cast<std::uint8_t>(number), static_cast<std::uint8_t>(place)});
    }
    file.require(!node.channels.empty(), "channels",
                 "must say what channel 1 is: { 1 = \"" + std::string(names[0]) + "\" }");
    if (node.channels.empty()) node.channels.push_back({1, static_cast<std::uint8_t>(places[0])});
  }

  void take_signal(const TomlTable& file, const std::string& key, std::size_t place, const std::string& node) {
    const auto [other, is_new] = signals_.emplace(place, node);
    file.require(is_new, key, "is taken by '" + other->second + "'");
    const auto twin = in_place_of(place) == place ? signals_.end() : signals_.find(in_place_of(place));
    file.require(twin == signals_.end(), key,
                 twin == signals_.end() ? ""
                                        : "'" + twin->second + "' has " + kSignals[twin->first].name +
                                              ": of a joint's length and angle there must be one");
  }

  /// Its inputs and outputs are frames like those of a machine's own controller.
  void read_module(TomlTable& file, NodeDescription& node) {
    if (file.has("inputs")) {
      const TomlTable inputs = file.table("inputs");
      for (BroadcastFrame& frame : read_inputs(inputs, node, bus_, sensors_)) {
        for (const BroadcastField& field : frame.fields) {
          const std::string key = std::to_string(analog_number(frame.pdo, field.bits)) + ".signal";
          if (inputs.sound({key})) take_signal(inputs, key, field.signal, node.name);
        }
        frame.id = take_pdo(file, node, false, frame.pdo);
        bus_.broadcasts.push_back(std::move(frame));
      }
    }
    if (!file.has("outputs")) return;
    const std::int64_t shift = file.integer("error_value_shift");
    const bool known = shift == 0 || shift == kAnalogBits;
    file.require(known, "error_value_shift",
                 "must be 16 where object 0x6444 has an output's 16 bits in its upper half, 0 where in its lower one");
    node.error_value_shift = static_cast<std::uint8_t>(known ? shift : 0);
    const std::size_t first = bus_.commands.size();
    read_outputs(file_, file.table("outputs"), node, bus_);
    for (std::size_t i = first; i < bus_.commands.size(); ++i)
      bus_.commands[i].id = take_pdo(file, node, true, bus_.commands[i].pdo);
  }

  /// @return its identifier
  std::uint32_t take_pdo(TomlTable& file, NodeDescription& node, bool to_node, std::uint8_t pdo) {
    constexpr std::array kTpdoKeys{"tpdo", "tpdo2", "tpdo3", "tpdo4"}, kRpdoKeys{"rpdo", "rpdo2", "rpdo3", "rpdo4"};
    const char* const key = (to_node ? kRpdoKeys : kTpdoKeys)[pdo];
    (to_node ? node.rpdos : node.tpdos)[pdo] = frame_id(file, key);
    const std::uint32_t id = to_node ? node.rpdo_id(pdo) : node.tpdo_id(pdo);
    take(file, node.name, key, id);
    return id;
  }

  void read(TomlTable& file, NodeDescription& node) {
    constexpr std::int64_t kMax32 = 0xFFFFFFFF;
    node.id = static_cast<std::uint8_t>(file.integer("id", 1, 127));
    if (file.sound({"id"})) {
      const auto [other, is_new] = ids_.emplace(node.id, node.name);
      file.require(is_new, "id", "is taken by '" + other->second + "'; node ids must be unique");
    }
    node.device_type = static_cast<std::uint32_t>(file.integer("device_type", 0, kMax32));
    file.require(
        may_be(node.device_type, node.role), "device_type",
        fmt::format("must have {0} = 0x{0:04X}, the number of the node's profile, in its lower 16 bits; has {1}",
                    profile_number(node.role), profile_number(node.device_type)),
        {"profile"});
    node.vendor = static_cast<std::uint32_t>(file.integer("vendor", 0, kMax32));
    node.product = static_cast<std::uint32_t>(file.integer("product", 0, kMax32));
    if (node.measures_angle()) node.rotary = read_rotary(file);
    if (node.role == NodeRole::kModule)
      read_module(file, node);
    else
      read_pdos(file, node);
    if (node.is_told() && file.has("unguarded")) node.unguarded = file.text("unguarded");
  }

  void read_pdos(TomlTable& file, NodeDescription& node) {
    read_maps(file, node);
    const std::vector<std::uint8_t> pdos = transmit_pdos(node, bus_.wire);
    file.require(pdos.size() <= NodeDescription::kMostPdos, "channels",
                 "need " + std::to_string(pdos.size()) + " frames, and a node has 4: use fewer channels" +
                     (bus_.wire.pressure == WireDescription::Pressure::kInteger16
                          ? ""
                          : ", or in [bus.wire] pressure_value = \"integer16\": a frame has two of those"));
    for (const std::uint8_t pdo : pdos) {
      if (pdo >= NodeDescription::kMostPdos) break;
      take_pdo(file, node, false, pdo);
    }
    for (const std::uint8_t pdo : receive_pdos(node)) take_pdo(file, node, true, pdo);
  }

  /// Optional, one after the other from the first.
  void read_maps(TomlTable& file, NodeDescription& node) const {
    constexpr double kMax32 = 0xFFFFFFFF;
    constexpr std::size_t kMostMapped = 8;  // bytes of a frame
    const std::vector<FrameField> wanted = sent_fields(node, bus_.wire);
    for (const char* key : {"tpdo_map", "tpdo2_map", "tpdo3_map", "tpdo4_map"}) {
      if (!file.has(key)) break;
      std::vector<std::uint32_t>& map = node.tpdo_maps.emplace_back();
      std::uint32_t bits = 0;
      for (const double entry : file.list(key, 1, kMostMapped, 0, kMax32)) {
        map.push_back(static_cast<std::uint32_t>(entry));
        const std::uint32_t own = canopen::mapped_bits(map.back());
        file.require(entry == std::floor(entry), key,
                     fmt::format("has {}: must be whole numbers, such as 0x61300120", number_text(entry)));
        file.require(own > 0, key, fmt::format("has 0x{:08X}, which is 0 bits: must be at least 1", map.back()));
        bits += own;
      }
      file.require(!node.is_told(), key,
                   "only goes with sensors: a node that moves something maps as start-up wants it");
      file.require(bits % 8 == 0 && bits <= 64, key, fmt::format("has {} bits: must be whole bytes, 8 at most", bits));
      require_once(file, key, node.tpdo_maps, wanted);
    }
    if (node.tpdo_maps.empty() || node.is_told()) return;
    const std::vector<FrameField> found = sent_fields(node, bus_.wire);
    for (const FrameField& field : wanted) {
      file.require(field.part != FrameField::Part::kValue || find_field(found, field.part, field.channel) != nullptr,
                   "tpdo_map",
                   fmt::format("must have 0x{:08X} ({}), or tpdo2_map to tpdo4_map must",
                               canopen::mapping(field.object, field.bits.bits), field.channel.info().name));
    }
  }
  /// Which of two would be the value is not known.
  static void require_once(const TomlTable& file, const char* key, const std::vector<std::vector<std::uint32_t>>& maps,
                           const std::vector<FrameField>& wanted) {
    for (const FrameField& field : wanted) {
      const std::uint32_t entry = canopen::mapping(field.object, field.bits.bits);
      const auto times_in = [&](const auto& map) { return std::count(map.begin(), map.end(), entry); };
      const auto here = times_in(maps.back());
      file.require(here <= 1, key, fmt::format("has 0x{:08X} twice", entry));
      const bool before = std::any_of(maps.begin(), maps.end() - 1, [&](const auto& map) { return times_in(map) > 0; });
      file.require(here == 0 || !before, key, fmt::format("has 0x{:08X}, which an earlier map has, too", entry));
    }
  }
  static RotaryDescription read_rotary(TomlTable& file) {
    RotaryDescription rotary;
    rotary.steps_per_turn = static_cast<std::uint32_t>(file.integer("steps_per_turn", 1 << 9, 1 << 24));
    if (file.has("turns")) {
      rotary.turns = static_cast<std::uint32_t>(file.integer("turns", 1, 1 << 16));
      file.require(std::int64_t{rotary.steps_per_turn} * rotary.turns <= kMostSteps, "turns",
                   "must be at most " + std::to_string(kMostSteps / rotary.steps_per_turn) + ": 2^31 steps in all",
                   {"steps_per_turn"});
    }
    if (file.has("sign")) {
      const std::int64_t sign = file.integer("sign");
      file.require(sign == 1 || sign == -1, "sign", "must be 1 or -1");
      rotary.sign = sign < 0 ? -1 : 1;
    }
    if (file.has("zero_rad")) rotary.zero_rad = file.number("zero_rad", -std::numbers::pi, std::numbers::pi);
    return rotary;
  }

  /// Optional. CiA 301 keeps what lies outside for other services.
  static std::uint16_t frame_id(TomlTable& file, const char* pdo) {
    if (!file.has(pdo)) return 0;
    const std::int64_t id = file.integer(pdo);
    const bool free = id >= 0x181 && id <= 0x57F;
    file.require(free, pdo, "must be within [0x181, 0x57F]");
    return static_cast<std::uint16_t>(free ? id : 0);
  }

  void take(const TomlTable& file, const std::string& name, const char* pdo, std::uint32_t id) {
    if (!file.sound({"id", pdo})) return;
    const auto [other, is_new] = frames_.emplace(id, name + "." + pdo);
    file.require(is_new, file.has(pdo) ? pdo : "id",
                 "its frames' identifier " + fmt::format("0x{:03X}", id) + " is taken by '" + other->second + "'");
  }

  const TomlTable& file_;
  BusDescription& bus_;
  const SensorDescription& sensors_;
  std::map<std::int64_t, std::string> ids_;
  std::map<std::uint32_t, std::string> frames_;
  std::map<std::size_t, std::string> signals_;
};

}  // namespace

std::vector<NodeDescription> read_nodes(TomlTable& file, BusDescription& bus, const SensorDescription& sensors) {
  NodeReader read(file, bus, sensors);
  if (!file.has("node") && file.has("nodes")) {
    file.require(bus.broadcasts.empty(), "broadcast",
                 "goes with [[bus.node]] tables alone: write them by knuckle bus migrate");
    file.require(!bus.by_frames(), "command", "goes with [[bus.node]] tables alone: write them by knuckle bus migrate");
    return read.read_keyed(file.table("nodes"));
  }
  if (file.has("nodes")) {
    file.leave("nodes");
    file.require(false, "nodes", "stands beside [[bus.node]] tables: keep one of the two");
  }
  std::vector<NodeDescription> nodes = read.read_listed(file.tables("node"));
  check_commands(file, bus);
  const std::string missing = read.missing(sensors.without_pressures);
  file.require(missing.empty(), "node", "no node has " + missing, {"broadcast", ".sensors.without_pressures"});
  const std::string told = read.told();
  file.require(told.empty(), file.has("command") ? "command" : "node",
               "stands beside node '" + told + "': valves are nodes, or frames and outputs tell all of them", {"node"});
  const std::string beside = read.pressure_of(sensors.without_pressures);
  file.require(beside.empty(), "node",
               "there is " + beside + ", although sensors.without_pressures says that nobody measures it",
               {".sensors.without_pressures"});
  return nodes;
}

}  // namespace knuckle
