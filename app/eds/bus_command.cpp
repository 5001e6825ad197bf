#include "app/eds/bus_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <utility>

#include "app/cli/interrupt.h"
#include "app/cli/output_file.h"
#include "app/eds/assign_id.h"
#include "app/eds/dbc_import.h"
#include "app/eds/migrate.h"
#include "core/error.h"
#include "machine/bus_description.h"
#include "machine/bus_frames.h"
#include "machine/channel_status.h"
#include "machine/device_profile.h"
#include "machine/file_text.h"
#include "machine/load.h"
#include "machine/load_bus_lines.h"
#include "machine/toml_reader.h"

namespace knuckle::eds {
namespace {

constexpr std::size_t kLargestMachine_MB = 1;

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

/// Keys and values of what depends on the device; without the profile.
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
  return all;
}

/// In [bus.nodes].
std::string with_line(const std::string& machine_text, const std::string& machine_source, const NodeDescription& node) {
  if (!node.tpdo_maps.empty())
    throw InputError(machine_source +
                     ": needs [[bus.node]] tables for a device with process data of its own: "
                     "knuckle bus migrate");
  std::string entry;
  for (const auto& [key, value] : settings_of(node)) entry += (entry.empty() ? "{ " : ", ") + key + " = " + value;
  if (node.profile != ValveProfile::kCia408) entry += ", profile = \"" + profile_name(node) + '"';
  bool found = false;
  int number = 0, own_table = 0;
  std::string text =
      edited_toml(machine_text, [&](const std::string& table, const std::string& key, std::string& line) {
        ++number;
        if (key == "[bus.nodes." + node.name + "]") own_table = number;
        if (table != "[bus.nodes]" || key != node.name) return;
        line = with_toml_value(line, entry + " }");
        found = true;
      });
  if (!found) {
    throw InputError(
        machine_source + ": " +
        (own_table > 0 ? fmt::format("line {}: [bus.nodes.{}] is a table of its own: ", own_table, node.name) : "") +
        "needs " + node.name + " = { ... } on one line in [bus.nodes], or [[bus.node]] tables (knuckle bus migrate)");
  }
  return text;
}

/// In its [[bus.node]] table.
std::string with_table(const std::string& machine_text, const std::string& machine_source,
                       const NodeDescription& node) {
  Settings settings = settings_of(node), added;
  if (node.role == NodeRole::kValve) settings.emplace_back("profile", '"' + profile_name(node) + '"');
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

namespace {

/// The lines of a file that is not there yet would lead nowhere.
MachineDescription parse_changed(const std::string& text, const std::string& source, const std::string& node,
                                 const DeviceFile& device) {
  try {
    return parse_machine(text, source);
  } catch (const FileErrors& errors) {
    std::string all;
    for (const std::string& line : errors.lines())
      all += (all.empty() ? "" : "; ") + line.substr(line.find(": ", source.size()) + 2);
    throw InputError(source + ": is as it was: with " + node + " of " + device.source + " it would be refused: " + all);
  }
}

}  // namespace

std::string with_device(const std::string& machine_text, const std::string& machine_source, const std::string& node,
                        std::uint8_t id, const DeviceFile& device) {
  BusDescription bus = parse_machine(machine_text, machine_source).bus;
  const NodeDescription& named = named_node(bus, node, machine_source);
  check_free(bus, id, named.name, machine_source);
  if (!may_be(device.device_type, named.role)) {
    throw InputError(fmt::format("{}: 0x1000:00 = 0x{:X}: is a device of CiA {}; {} must be one of CiA {}",
                                 device.source, device.device_type, profile_number(device.device_type), named.name,
                                 profile_number(named.role)));
  }
  NodeDescription& changed = bus.nodes[static_cast<std::size_t>(&named - bus.nodes.data())];
  changed = node_with(named, id, device, bus.wire);
  const std::string text = has_node_tables(machine_text, machine_source)
                               ? with_table(machine_text, machine_source, changed)
                               : with_line(machine_text, machine_source, changed);
  const BusDescription read = parse_changed(text, machine_source, changed.name, device).bus;  // as programs will
  changed.guard = read.node_of(changed.role, changed.channels.front().info().index).guard;  // proved of another device
  if (!(read == bus)) {
    throw InputError(machine_source + ": needs " + changed.name +
                     " in a [[bus.node]] table with each key on a line of its own");
  }
  return text;
}

namespace {

struct BusOptions {
  std::string action, file, id, as, machine, can, from, bus;
  std::optional<std::uint32_t> serial;
  std::vector<std::string> by_objects, signals, commands, constants, counters;
};

/// "0x20F0" or "0x20F0:01", the sub-index in hexadecimal.
canopen::Object own_object(const std::string& text) {
  const auto colon = text.find(':');
  const auto index = cli::whole_number(text.substr(0, colon), 0xFFFF);
  const auto subindex = colon == std::string::npos ? 0 : cli::whole_number("0x" + text.substr(colon + 1), 0xFF);
  if (!text.starts_with("0x") || !index || *index < 0x2000 || !subindex)
    cli::refuse_option("--by-object", text, "must be an object of the device, such as 0x20F0 or 0x20F0:01");
  return {static_cast<std::uint16_t>(*index), static_cast<std::uint8_t>(*subindex)};
}

/// The machine file's text, where it may be changed.
std::string text_to_change(const std::string& machine, cli::Places& places) {
  if (std::error_code none; !std::filesystem::exists(machine, none) && has_config("machine", machine)) {
    cli::refuse_option("--machine", machine,
                       "is a machine that comes with Knuckle: copy its file first: cp " +
                           find_config("machine", machine) + " my_machine.toml");
  }
  cli::check_readable("--machine", machine);
  places.configuration_output("--machine", machine);
  return whole_file(machine, kLargestMachine_MB);
}

/// What was said must be readable, or what was done is said in the one line that then is.
/// @throws InputError
void check_said(const std::string& done) {
  const cli::InterruptGuard pipes_only_fail;
  errno = 0;
  if (std::cout.flush() || errno == EPIPE || errno == EBADF) return;  // nobody wanted to read it
  throw InputError("standard output: cannot be written; " + done);
}

/// @return what the older one is called now; empty where nothing changed.
std::string write_keeping_older(const std::string& machine, const std::string& text) {
  cli::OutputFile out("--machine", machine);
  out.stream() << text;
  return out.commit_keeping_older();
}

int add(const BusOptions& o) {
  const std::uint8_t id = cli::node_id("--id", o.id);
  cli::check_readable("FILE", o.file);
  cli::Places places;
  places.input("FILE", o.file);
  const std::string before = text_to_change(o.machine, places);
  const DeviceFile device = read_device_file(o.file);
  const std::string text = with_device(before, o.machine, o.as, id, device);
  const MachineDescription machine = parse_machine(text, o.machine);
  const std::string node = named_node(machine.bus, o.as, o.machine).name;
  const Fit fit = fit_of(device, machine, node);
  for (const std::string& slip : device.slips) std::cout << "note: " << o.file << ": " << slip << '\n';
  for (const std::string& note : fit.notes) std::cout << "note: " << o.file << ": " << note << '\n';
  if (const std::string lacks = missing_status_text(*machine.bus.find(node), machine); !lacks.empty())
    std::cout << "note: " << node << ' ' << lacks << '\n';
  for (const std::string& obstacle : fit.obstacles)
    std::cerr << "knuckle: " << node << " cannot be this device: " << obstacle << '\n';
  if (!fit.obstacles.empty()) {
    std::cerr << "knuckle: " << o.machine << " is as it was\n";
    return 2;
  }
  const std::string kept = write_keeping_older(o.machine, text);
  std::cout << node << " is " << device.vendor_name << ' ' << device.product_name << ", node "
            << fmt::format("0x{:02X}", id) << ", in " << o.machine
            << (text == before ? " (it was so already: nothing changed)" : " (before: " + kept + ")") << '\n';
  for (const std::string& step : fit.to_set) std::cout << "to do: " << step << '\n';
  if (text != before) check_said(o.machine + " has been changed (before: " + kept + ")");
  return 0;
}

int migrate(const std::string& machine) {
  cli::Places places;
  const std::string before = text_to_change(machine, places), text = with_node_tables(before, machine);
  const bool same = text == before;
  const std::string kept = same ? "" : write_keeping_older(machine, text);
  std::cout << machine << ": its nodes are [[bus.node]] tables"
            << (same ? " already: nothing changed" : " (before: " + kept + ")") << '\n';
  if (!same) check_said(machine + " has been changed (before: " + kept + ")");
  return 0;
}

int import_dbc(const BusOptions& o) {
  std::vector<WantedSignal> signals;
  for (const std::string& one : o.signals) signals.push_back(wanted_signal(one));
  WantedFrames told;
  for (const std::string& one : o.commands) told.commands.push_back(wanted_command(one));
  for (const std::string& one : o.constants) told.constants.push_back(wanted_constant(one));
  for (const std::string& one : o.counters) told.counters.push_back(wanted_counter(one));
  if (signals.empty() && told.commands.empty() && told.constants.empty() && told.counters.empty())
    cli::refuse_option("--signal", "", "is required by bus import, or --command, --constant or --counter is");
  cli::check_readable("FILE", o.file);
  cli::Places places;
  places.input("FILE", o.file);
  const std::string before = text_to_change(o.machine, places);
  const DbcFile dbc = read_dbc(o.file);
  const Import import = with_frames(before, o.machine, dbc, signals, told,
                                    o.bus.empty() ? std::nullopt : std::optional(wanted_bus(o.bus)));
  for (const std::string& slip : dbc.slips) std::cout << "note: " << o.file << ": " << slip << '\n';
  const std::string kept = write_keeping_older(o.machine, import.text);
  for (const std::string& frame : import.frames) std::cout << frame << '\n';
  if (!import.gone_nodes.empty())
    std::cout << "no nodes any more: " << fmt::format("{}", fmt::join(import.gone_nodes, ", ")) << '\n';
  std::cout << "in " << o.machine << " (before: " << kept << ")\n";
  for (const std::string& step : import.to_do) std::cout << "to do: " << step << '\n';
  check_said(o.machine + " has been changed (before: " + kept + ")");
  return 0;
}

/// Which device has the id, and what the machine file calls it.
std::string given_text(const IdRequest& request, const AssignedId& given) {
  const NodeDescription* const node = request.bus.find(request.id);
  std::string name;
  if (!request.machine.empty())
    name = node != nullptr ? ", " + node->name + " in " + request.machine + ", whose vendor and product it has"
                           : ", which " + request.machine + " has not";
  const std::string before =
      given.before == lss::kNoNodeId ? "had no node id" : fmt::format("was node 0x{:02X}", given.before);
  return fmt::format("{}: {}, is node 0x{:02X}{}", text(given.device), before, request.id, name);
}

int assign(const BusOptions& o) {
  IdRequest request;
  request.id = cli::node_id("--id", o.id);
  if (!o.from.empty()) request.from = cli::node_id("--from", o.from);
  if (request.from == request.id) cli::refuse_option("--from", o.from, "is the node id that it is to have");
  if (request.from && o.serial) cli::refuse_option("--serial", "", "does not go with --from, which names the device");
  request.serial = o.serial;
  for (const std::string& one : o.by_objects) request.objects.push_back(own_object(one));
  if (!request.objects.empty() && !request.from)
    cli::refuse_option("--by-object", o.by_objects[0], "needs --from: the node id that the device has now");
  if (!o.machine.empty()) {
    request.machine = o.machine;
    request.bus = load_machine(find_config("machine", o.machine)).bus;
  }
  if (request.id == request.bus.controller_id)
    cli::refuse_option("--id", o.id, "is the controller's" + (o.machine.empty() ? "" : " in " + o.machine));
  const cli::InterruptGuard interrupt;
  BusAccess access = real_access(o.can);
  const AssignedId given = assign_id(access, request, [&](bool told) {
    if (!interrupt.pending()) return;
    throw cli::Interrupted(told ? "the device may have its new node id: see knuckle doctor --can " + o.can
                                : "no device was told another node id");
  });
  if (!given.problem.empty()) {
    std::cerr << "knuckle: " << o.can << ": " << text(given.device) << ": " << given.problem << '\n';
    return 1;
  }
  std::cout << given_text(request, given)
            << (given.device.serial != 0
                    ? "; found there with the same serial\n"
                    : "; found there; it has no serial: another one of its kind would look the same\n");
  check_said("the device has its new node id");
  return 0;
}

/// Refuses an option that the action needs and has not, or has and does not know.
void check_options(const BusOptions& o) {
  struct Option {
    const char* name;
    bool given;
    std::string value, needed_by, known_by;
  };
  const std::string add = " add ", import = " import ", assign = " assign-id ", migrate = " migrate ";
  const std::string action = ' ' + o.action + ' ';
  for (const auto& [name, given, value, needed_by, known_by] :
       {Option{"FILE", !o.file.empty(), o.file, add + import, add + import},
        {"--id", !o.id.empty(), o.id, add + assign, add + assign},
        {"--as", !o.as.empty(), o.as, add, add},
        {"--machine", !o.machine.empty(), o.machine, add + import + migrate, add + import + migrate + assign},
        {"--signal", !o.signals.empty(), "", "", import},
        {"--command", !o.commands.empty(), "", "", import},
        {"--constant", !o.constants.empty(), "", "", import},
        {"--counter", !o.counters.empty(), "", "", import},
        {"--bus", !o.bus.empty(), o.bus, "", import},
        {"--can", !o.can.empty(), o.can, assign, assign},
        {"--from", !o.from.empty(), o.from, "", assign},
        {"--serial", o.serial.has_value(), "", "", assign},
        {"--by-object", !o.by_objects.empty(), "", "", assign}}) {
    if (!given && needed_by.find(action) != std::string::npos)
      cli::refuse_option(name, "", "is required by bus " + o.action);
    if (given && known_by.find(action) == std::string::npos)
      cli::refuse_option(name, value, "does not go with bus " + o.action);
  }
}

int run_bus(const BusOptions& o) {
  check_options(o);
  if (o.action == "add") return add(o);
  if (o.action == "import") return import_dbc(o);
  return o.action == "assign-id" ? assign(o) : migrate(o.machine);
}

}  // namespace

cli::Command bus_entry() {
  return {
      "bus",
      "Puts a device that is sold, or frames of the machine's own controller, into a machine file; gives node ids",
      [](const cli::OptionList& command) {
        const auto o = std::make_shared<BusOptions>();
        command
            .add_option(
                "ACTION", o->action,
                "assign-id: gives the device on the bus a node id. add: puts a device into the machine file. "
                "import: puts frames from and to the machine's own controller into it. migrate: writes [bus.nodes] as "
                "[[bus.node]] tables")
            .required()
            .one_of({"assign-id", "add", "import", "migrate"});
        command.add_option(
            "FILE", o->file,
            "add: the device's file from its vendor (.eds). import: the machine's from its maker (.dbc)");
        command.add_option("--id", o->id, "add, assign-id: node id of the device, 1 to 127 or 0x01 to 0x7F");
        command.add_option("--as", o->as, "add: name of the node whose place it takes: boom_valve, tilt, ...");
        command
            .add_option(
                "--signal", o->signals,
                "import: a signal and where it is: boom_angle=MESSAGE.SIGNAL, as the DBC calls them (repeatable)")
            .one_value_each();
        command
            .add_option("--command", o->commands,
                        "import: what moves a joint, with its values at full speed: "
                        "boom=MESSAGE.SIGNAL:extend=0.4,retract=-0.4 (repeatable)")
            .one_value_each();
        command
            .add_option("--constant", o->constants,
                        "import: what another signal of such a message rests at: MESSAGE.SIGNAL=NEUTRAL, or "
                        "NEUTRAL,LED where it is LED while an operator leads; MESSAGE=NEUTRAL for all others "
                        "(repeatable)")
            .one_value_each();
        command
            .add_option("--counter", o->counters, "import: the counter of such a message: MESSAGE.SIGNAL (repeatable)")
            .one_value_each();
        command.add_option("--bus", o->bus,
                           "import: on which bus: its name in the machine file; NAME=KBPS makes a second one");
        command.add_option(
            "--machine", o->machine,
            "add, import, migrate: machine file (.toml) that is changed; as it was, it is kept as FILE.N.toml. "
            "assign-id: name or file of the machine whose node it is to be");
        command.add_option("--can", o->can, "assign-id: CAN interface");
        command.add_option("--from", o->from,
                           "assign-id: node id that it has now (default: the one device that answers LSS)");
        command.add_option("--serial", o->serial, "assign-id: of several equal devices with LSS, the one to change");
        command
            .add_option("--by-object", o->by_objects,
                        "assign-id: object of the device that holds its node id, instead of LSS: 0x20F0 or 0x20F0:01")
            .one_value_each();
        return [o] { return run_bus(*o); };
      }};
}

}  // namespace knuckle::eds
