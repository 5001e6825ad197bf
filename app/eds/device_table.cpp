// `knuckle bus add`: the device in the machine file's text.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "app/eds/bus_command.h"
#include "app/eds/migrate.h"
#include "core/error.h"
#include "machine/bus_description.h"
#include "machine/bus_frames.h"
#include "machine/device_profile.h"
#include "machine/file_text.h"
#include "machine/load.h"
#include "machine/load_bus_lines.h"
#include "machine/toml_reader.h"

namespace knuckle::eds {
namespace {

/// @throws InputError where the controller or a node other than this one has the id.
void check_free(const BusDescription& bus, std::uint8_t id, const std::string& node, const std::string& source) {
  const NodeDescription* const other = bus.find(id);
  const bool of_another = other != nullptr && other->name != node;
  if (id != bus.controller_id && !of_another) return;
  cli::refuse_option("--id", fmt::format("0x{:02X}", id),
                     "is the id of " + (of_another ? other->name : "the controller") + " in " + source);
}

/// The identifier of a PDO that the device sends or hears under, where it can only be read and is not the usual one;
/// else 0.
std::uint16_t fixed_frame(const DeviceFile& device, canopen::Object cob_id, std::uint32_t usual, std::uint8_t id) {
  const Entry* entry = device.find(cob_id);
  if (entry == nullptr || !entry->value || entry->access == Access::kReadWrite) return 0;
  const std::uint32_t frame = entry->value->of(id) & 0x7FF;
  return static_cast<std::uint16_t>(frame == usual ? 0 : frame);
}

/// What a sensor's PDOs map, where it lets nobody change that and start-up wants it otherwise; else nothing, and
/// nothing where a machine file cannot say it: fit_of() tells of that.
std::vector<std::vector<std::uint32_t>> fixed_maps(const DeviceFile& device, const NodeDescription& node,
                                                   const WireDescription& wire, std::uint8_t id) {
  BusDescription alone;
  alone.wire = wire;
  alone.nodes = {node};
  const std::vector<BusFrame> wanted = bus_frames(alone);
  constexpr std::uint32_t kMostMapped = 8;  // bytes of a frame; 0xFE and 0xFF are multiplexed PDOs
  std::vector<std::vector<std::uint32_t>> maps;
  for (std::size_t pdo = 0; pdo < NodeDescription::kMostPdos; ++pdo) {
    const auto index = static_cast<std::uint16_t>(canopen::kTpdo1MapCount.index + pdo);
    const Entry* const count = device.find({index, 0});
    if (count == nullptr || !count->value) break;
    // A PDO that cannot be turned off cannot be mapped.
    const Entry* const cob_id = device.find({static_cast<std::uint16_t>(canopen::kTpdo1CobId.index + pdo), 1});
    const bool may_be_off = cob_id == nullptr || cob_id->access == Access::kReadWrite;
    if (count->access == Access::kReadWrite && may_be_off) break;
    const std::uint32_t mapped = count->value->of(id);
    if (mapped > kMostMapped) break;
    std::vector<std::uint32_t>& map = maps.emplace_back();
    for (std::uint32_t i = 1; i <= mapped; ++i) {
      const Entry* entry = device.find({index, static_cast<std::uint8_t>(i)});
      if (entry == nullptr || !entry->value) return {};
      map.push_back(entry->value->of(id));
    }
  }
  while (!maps.empty() && maps.back().empty()) maps.pop_back();
  bool as_wanted = true;
  for (std::size_t pdo = 0; pdo < maps.size(); ++pdo) {
    if (maps[pdo].empty()) return {};  // a machine file cannot say that one before others maps nothing
    if (pdo >= wanted.size()) continue;
    const std::vector<std::uint32_t>& first = wanted[pdo].mapped;  // more behind them is read as well
    as_wanted =
        as_wanted && maps[pdo].size() >= first.size() && std::equal(first.begin(), first.end(), maps[pdo].begin());
  }
  return as_wanted ? decltype(maps)() : maps;
}

/// An EDS does not say which control words a valve wants: that is known of its kind.
ValveProfile valve_profile(const DeviceFile& device) {
  constexpr std::uint32_t kDanfoss = 0x01000019, kPvedCc = 0x53373235;
  return device.vendor == kDanfoss && device.product == kPvedCc ? ValveProfile::kPved : ValveProfile::kCia408;
}

/// The node with the device in its place.
NodeDescription node_with(NodeDescription node, std::uint8_t id, const DeviceFile& device,
                          const WireDescription& wire) {
  node.id = id;
  node.device_type = device.device_type;
  node.vendor = device.vendor;
  node.product = device.product;
  node.tpdos = {};
  node.tpdo_maps.clear();
  node.rpdos = {};
  if (!node.is_told()) node.tpdo_maps = fixed_maps(device, node, wire, id);
  const auto fixed = [&](canopen::Object first, std::uint8_t pdo, std::uint32_t usual) {
    return fixed_frame(device, {static_cast<std::uint16_t>(first.index + pdo), first.subindex}, usual, id);
  };
  for (const std::uint8_t pdo : transmit_pdos(node, wire))
    node.tpdos[pdo] = fixed(canopen::kTpdo1CobId, pdo, node.tpdo_id(pdo));
  for (const std::uint8_t pdo : receive_pdos(node))
    node.rpdos[pdo] = fixed(canopen::kRpdo1CobId, pdo, node.rpdo_id(pdo));
  if (node.role == NodeRole::kValve) node.profile = valve_profile(device);
  return node;
}

using Settings = std::vector<std::pair<std::string, std::string>>;
// Optional ones.
constexpr std::array kFrameKeys{"tpdo", "tpdo2", "tpdo3", "tpdo4", "rpdo", "rpdo2", "rpdo3", "rpdo4"};
constexpr std::array kMapKeys{"tpdo_map", "tpdo2_map", "tpdo3_map", "tpdo4_map"};
bool is_optional(const std::string& key) {
  return std::find(kFrameKeys.begin(), kFrameKeys.end(), key) != kFrameKeys.end() ||
         std::find(kMapKeys.begin(), kMapKeys.end(), key) != kMapKeys.end();
}

/// Keys and values of what depends on the device.
Settings settings_of(const NodeDescription& node) {
  Settings all{{"id", fmt::format("0x{:02X}", node.id)},
               {"device_type", fmt::format("0x{:X}", node.device_type)},
               {"vendor", fmt::format("0x{:X}", node.vendor)},
               {"product", fmt::format("0x{:X}", node.product)}};
  for (std::size_t i = 0; i < kFrameKeys.size(); ++i) {
    const std::size_t tpdos = node.tpdos.size();
    const std::uint16_t frame = i < tpdos ? node.tpdos[i] : node.rpdos[i - tpdos];
    if (frame != 0) all.emplace_back(kFrameKeys[i], fmt::format("0x{:03X}", frame));
  }
  for (std::size_t i = 0; i < node.tpdo_maps.size(); ++i)
    all.emplace_back(kMapKeys[i], fmt::format("[0x{:08X}]", fmt::join(node.tpdo_maps[i], ", 0x")));
  if (node.role == NodeRole::kValve) all.emplace_back("profile", '"' + profile_name(node) + '"');
  return all;
}

/// In its [[bus.node]] table.
std::string with_table(const std::string& machine_text, const std::string& machine_source,
                       const NodeDescription& node) {
  const Settings settings = settings_of(node);
  Settings added;
  int place = 0, at = 0;
  TomlTable file = TomlTable::parse(machine_text, machine_source);
  for (TomlTable& table : bus_tables(file).front().tables("node")) {
    ++at;
    if (table.text("name") != node.name) continue;
    place = at;
    for (const auto& setting : settings)
      if (!table.has(setting.first)) added.push_back(setting);
  }
  const auto edit = [&](const std::string& table, const std::string& key, std::string& line) {
    constexpr const char* kTable = "[[bus.node]]";
    if (key == kTable) --place;
    if (table != kTable || place != 0 || key == kTable) return;
    const auto set = std::find_if(settings.begin(), settings.end(), [&](const auto& one) { return one.first == key; });
    if (set != settings.end()) {
      line = with_toml_value(line, set->second);
    } else if (is_optional(key)) {
      const auto comment = line.find('#');
      line = comment == std::string::npos ? "" : line.substr(comment);
    }
    if (key != "product") return;
    const std::string end = line.ends_with('\r') ? "\r" : "";
    for (const auto& [name, value] : added) line += '\n' + name + " = " + value + end;
  };
  return edited_toml(machine_text, edit);
}

}  // namespace

const NodeDescription& named_node(const BusDescription& bus, const std::string& name, const std::string& source) {
  if (const NodeDescription* node = bus.find(name)) return *node;
  throw InputError(source + ": has no node '" + name + "'; its nodes: " + bus.node_names());
}

std::string profile_name(const NodeDescription& node) {
  if (node.role == NodeRole::kValve) return kValveProfileNames[static_cast<std::size_t>(node.profile)];
  return fmt::format("cia{}", profile_number(node.role));
}

MachineDescription parse_changed(const std::string& text, const std::string& source, const std::string& with) {
  try {
    return parse_machine(text, source);
  } catch (const InputError& error) {
    const auto* const several = dynamic_cast<const FileErrors*>(&error);
    std::string all;
    for (const std::string& line : several != nullptr ? several->lines() : std::vector<std::string>{error.what()}) {
      const auto place = line.starts_with(source) ? line.find(": ", source.size()) : std::string::npos;
      all += (all.empty() ? "" : "; ") + (place == std::string::npos ? line : line.substr(place + 2));
    }
    throw InputError(source + ": is as it was: with " + with + " it would be refused: " + all);
  }
}

std::string with_device(const std::string& machine_text, const std::string& machine_source, const std::string& node,
                        std::uint8_t id, const DeviceFile& device) {
  const std::string tables = with_node_tables(machine_text, machine_source);
  BusDescription bus = parse_machine(tables, machine_source).bus;
  const NodeDescription& named = named_node(bus, node, machine_source);
  check_free(bus, id, named.name, machine_source);
  if (!may_be(device.device_type, named.role)) {
    throw InputError(fmt::format("{}: 0x1000:00 = 0x{:X}: is a device of CiA {}; {} must be one of CiA {}",
                                 device.source, device.device_type, profile_number(device.device_type), named.name,
                                 profile_number(named.role)));
  }
  NodeDescription& changed = bus.nodes[static_cast<std::size_t>(&named - bus.nodes.data())];
  changed = node_with(named, id, device, bus.wire);
  const std::string text = with_table(tables, machine_source, changed);
  const BusDescription read =
      parse_changed(text, machine_source, changed.name + " of " + device.source).bus;       // as programs will
  changed.guard = read.node_of(changed.role, changed.channels.front().info().index).guard;  // proved of another device
  if (!(read == bus)) {
    throw InputError(machine_source + ": needs " + changed.name +
                     " in a [[bus.node]] table with each key on a line of its own");
  }
  return text;
}

}  // namespace knuckle::eds
