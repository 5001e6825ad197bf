#include "app/eds/bus_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <iostream>
#include <memory>

#include "app/cli/output_file.h"
#include "core/error.h"
#include "machine/bus_description.h"
#include "machine/file_text.h"
#include "machine/load.h"
#include "slave/node_setup.h"

namespace knuckle::eds {
namespace {

constexpr std::size_t kLargestMachine_MB = 1;

/// CiA's number of the device profile, which is the lower half of the device type.
std::uint16_t profile_of(NodeRole role) {
  switch (role) {
    case NodeRole::kValve:
      return 408;
    case NodeRole::kPressure:
      return 404;
    case NodeRole::kEncoder:
      return 406;
    case NodeRole::kTilt:
      return 410;
    case NodeRole::kEnable:
      break;
  }
  return 401;
}

const NodeDescription& node_of(const BusDescription& bus, const std::string& name, const std::string& source) {
  if (const NodeDescription* node = bus.find(name)) return *node;
  throw InputError(source + ": has no node '" + name + "'; its nodes: " + bus.node_names());
}

/// @throws InputError where the controller or a node other than this one has the id.
void check_free(const BusDescription& bus, std::uint8_t id, const std::string& node, const std::string& source) {
  const NodeDescription* const other = bus.find(id);
  const bool of_another = other != nullptr && other->name != node;
  if (id != bus.controller_id && !of_another) return;
  cli::refuse_option("--id", fmt::format("0x{:02X}", id),
                     "is the id of " + (of_another ? other->name : "the controller") + " in " + source);
}

/// The identifier of a PDO that the device sends or hears under, where it can only be read and is not the usual one.
std::string fixed_frame(const DeviceFile& device, canopen::Object cob_id, const char* key, std::uint32_t usual,
                        std::uint8_t id) {
  const Entry* entry = device.find(cob_id);
  if (entry == nullptr || !entry->value || entry->access == Access::kReadWrite) return "";
  const std::uint32_t frame = entry->value->of(id) & 0x7FF;
  return frame == usual ? "" : fmt::format(", {} = 0x{:03X}", key, frame);
}

/// An EDS does not say which control words a valve wants: that is known of its kind.
std::string profile_key(const DeviceFile& device) {
  constexpr std::uint32_t kDanfoss = 0x01000019, kPvedCc = 0x53373235;
  if (device.vendor != kDanfoss || device.product != kPvedCc) return "";
  return fmt::format(", profile = \"{}\"", kValveProfileNames[static_cast<std::size_t>(ValveProfile::kPved)]);
}

std::string object_text(canopen::Object object, const Entry* entry) {
  const std::string name = entry != nullptr && !entry->name.empty() ? " (" + entry->name + ")" : "";
  return fmt::format("0x{:04X}:{:02X}{}", object.index, object.subindex, name);
}

}  // namespace

std::string with_device(const std::string& machine_text, const std::string& machine_source, const std::string& node,
                        std::uint8_t id, const DeviceFile& device) {
  const BusDescription bus = parse_machine(machine_text, machine_source).bus;
  const NodeDescription named = node_of(bus, node, machine_source);
  check_free(bus, id, node, machine_source);
  const auto profile = static_cast<std::uint16_t>(device.device_type & 0xFFFF);
  if (profile != profile_of(named.role)) {
    throw InputError(fmt::format("{}: 0x1000:00 = 0x{:X}: is a device of CiA {}; {} must be one of CiA {}",
                                 device.source, device.device_type, profile, node, profile_of(named.role)));
  }
  std::string entry = fmt::format("{{ id = 0x{:02X}, device_type = 0x{:X}, vendor = 0x{:X}, product = 0x{:X}", id,
                                  device.device_type, device.vendor, device.product);
  entry += fixed_frame(device, canopen::kTpdo1CobId, "tpdo", canopen::tpdo1_id(id), id);
  if (named.role == NodeRole::kValve) entry += profile_key(device);
  if (named.role == NodeRole::kValve || named.role == NodeRole::kEnable)
    entry += fixed_frame(device, canopen::kRpdo1CobId, "rpdo", canopen::rpdo1_id(id), id);
  bool found = false;
  int number = 0, own_table = 0;
  std::string text =
      edited_toml(machine_text, [&](const std::string& table, const std::string& key, std::string& line) {
        ++number;
        if (key == "[bus.nodes." + node + "]") own_table = number;
        if (table != "[bus.nodes]" || key != node) return;
        line = with_toml_value(line, entry + " }");
        found = true;
      });
  if (!found) {
    throw InputError(
        machine_source + ": " +
        (own_table > 0 ? fmt::format("line {}: [bus.nodes.{}] is a table of its own: ", own_table, node) : "") +
        "needs " + node + " = { ... } on one line in [bus.nodes]");
  }
  (void)parse_machine(text, machine_source);  // as every program will read it
  return text;
}

namespace {

/// Why start-up would fail at this part; empty where it would not.
std::string obstacle_of(const DeviceFile& device, const slave::SetupPart& part, std::uint8_t id) {
  const auto may_write = [](const Entry& entry) {
    return entry.access == Access::kReadWrite || entry.access == Access::kWriteOnly;
  };
  bool as_wanted = true;
  for (const slave::SdoStep& step : part.asked) {
    const Entry* entry = device.find(step.object);
    if (entry == nullptr)
      return fmt::format("start-up reads {}, which the device does not have", object_text(step.object, entry));
    const bool holds = entry->value && step.holds(entry->value->of(id));
    as_wanted = as_wanted && holds;
    if (part.written.empty() && !holds && entry->value && !may_write(*entry)) {
      return fmt::format("{} must be {} and is always {}", object_text(step.object, entry), step.value,
                         entry->value->of(id));
    }
  }
  if (as_wanted) return "";
  for (const slave::SdoStep& step : part.written) {
    const Entry* entry = device.find(step.object);
    if (entry == nullptr || !may_write(*entry))
      return fmt::format("start-up writes {}, which can only be read", object_text(step.object, entry));
  }
  return "";
}

}  // namespace

Fit fit_of(const DeviceFile& device, const MachineDescription& machine, const std::string& node) {
  const std::uint8_t id = node_of(machine.bus, node, machine.source).id;
  Fit fit;
  const int kbps = static_cast<int>(machine.bus.bit_rate / 1000);
  if (const auto& rates = device.bit_rates_kbps;
      !rates.empty() && std::find(rates.begin(), rates.end(), kbps) == rates.end())
    fit.obstacles.push_back(fmt::format("the bus has {} kbit/s, which the device does not know", kbps));
  const auto scripts = slave::node_scripts(machine);
  const auto script =
      std::find_if(scripts.begin(), scripts.end(), [&](const auto& one) { return one.node.name == node; });
  int guards = 0;
  bool guarded = false;
  for (const slave::SetupPart& part : script->script) {
    using Kind = slave::SetupPart::Kind;
    if (part.kind == Kind::kIdentity) continue;
    const std::string obstacle = obstacle_of(device, part, id);
    if (part.kind == Kind::kGuard) {
      ++guards;
      guarded = guarded || obstacle.empty();
    } else if (!obstacle.empty()) {
      fit.obstacles.push_back(obstacle);
    }
    if (part.kind != Kind::kRequire) continue;
    for (const slave::SdoStep& step : part.asked) {
      const Entry* entry = device.find(step.object);
      if (!obstacle.empty() || entry == nullptr || !entry->value || step.holds(entry->value->of(id))) continue;
      fit.to_set.push_back(fmt::format("set {} of the device to {}: it is delivered with {}",
                                       object_text(step.object, entry), step.value, entry->value->of(id)));
    }
  }
  if (guards > 0 && !guarded)
    fit.obstacles.push_back("it has no guard that start-up knows: without its controller it would not stop");
  return fit;
}

namespace {

struct BusOptions {
  std::string action, file, id, as, machine;
};

std::uint8_t node_id(const std::string& text) {
  const bool hex = text.starts_with("0x");
  unsigned id = 0;
  const char* const begin = text.data() + (hex ? 2 : 0);
  const auto [end, error] = std::from_chars(begin, text.data() + text.size(), id, hex ? 16 : 10);
  if (error != std::errc() || end != text.data() + text.size() || id < 1 || id > 127)
    cli::refuse_option("--id", text, "must be a node id, 1 to 127 or 0x01 to 0x7F");
  return static_cast<std::uint8_t>(id);
}

int run_bus(const BusOptions& o) {
  const std::uint8_t id = node_id(o.id);
  cli::check_readable("FILE", o.file);
  if (std::error_code none; !std::filesystem::exists(o.machine, none) && has_config("machine", o.machine)) {
    cli::refuse_option("--machine", o.machine,
                       "is a machine that comes with Knuckle: copy its file first: cp " +
                           find_config("machine", o.machine) + " my_machine.toml");
  }
  cli::check_readable("--machine", o.machine);
  cli::Places places;
  places.input("FILE", o.file);
  places.configuration_output("--machine", o.machine);
  const DeviceFile device = read_device_file(o.file);
  const std::string before = whole_file(o.machine, kLargestMachine_MB);
  const std::string text = with_device(before, o.machine, o.as, id, device);
  const Fit fit = fit_of(device, parse_machine(text, o.machine), o.as);
  for (const std::string& slip : device.slips) std::cout << "note: " << o.file << ": " << slip << '\n';
  for (const std::string& obstacle : fit.obstacles)
    std::cerr << "knuckle: " << o.as << " cannot be this device: " << obstacle << '\n';
  if (!fit.obstacles.empty()) {
    std::cerr << "knuckle: " << o.machine << " is as it was\n";
    return 1;
  }
  cli::OutputFile out("--machine", o.machine);
  out.stream() << text;
  const std::string kept = out.commit_keeping_older();
  std::cout << o.as << " is " << device.vendor_name << ' ' << device.product_name << ", node "
            << fmt::format("0x{:02X}", id) << ", in " << o.machine
            << (text == before ? " (it was so already: nothing changed)" : " (before: " + kept + ")") << '\n';
  for (const std::string& step : fit.to_set) std::cout << "to do: " << step << '\n';
  return 0;
}

}  // namespace

cli::Command bus_entry() {
  return {
      "bus", "Puts a device that is sold into a machine file, from its vendor's EDS",
      [](const cli::OptionList& command) {
        const auto o = std::make_shared<BusOptions>();
        command.add_option("ACTION", o->action, "add").required().one_of({"add"});
        command.add_option("FILE", o->file, "The device's file from its vendor (.eds)").required();
        command.add_option("--id", o->id, "Node id of the device, 1 to 127 or 0x01 to 0x7F").required();
        command.add_option("--as", o->as, "Name of the node whose place it takes: boom_valve, tilt, ...").required();
        command
            .add_option("--machine", o->machine,
                        "Machine file (.toml) that is changed; as it was, it is kept as FILE.N.toml")
            .required();
        return [o] { return run_bus(*o); };
      }};
}

}  // namespace knuckle::eds
