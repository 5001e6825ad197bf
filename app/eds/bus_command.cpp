#include "app/eds/bus_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

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
#include "machine/file_text.h"
#include "machine/load.h"

namespace knuckle::eds {
namespace {

constexpr std::size_t kLargestMachine_MB = 1;

struct BusOptions {
  std::string action, file, id, as, machine, can, from, bus;
  std::optional<std::uint32_t> serial;
  std::vector<std::string> by_objects, signals, commands, constants, counters, checksums, periods;
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
  for (const std::string& one : o.checksums) told.checksums.push_back(wanted_checksum(one));
  for (const std::string& one : o.periods) told.periods.push_back(wanted_period(one));
  if (signals.empty() && told.commands.empty() && told.constants.empty() && told.counters.empty() &&
      told.checksums.empty())
    cli::refuse_option("--signal", "",
                       "is required by bus import, or --command, --constant, --counter or --checksum is");
  cli::check_readable("FILE", o.file);
  cli::Places places;
  places.input("FILE", o.file);
  const std::string before = text_to_change(o.machine, places);
  const DbcFile dbc = read_dbc(o.file);
  const Import import = with_frames(before, o.machine, dbc, signals, told,
                                    o.bus.empty() ? std::nullopt : std::optional(wanted_bus(o.bus)));
  for (const std::string& slip : dbc.slips) std::cout << "note: " << o.file << ": " << slip << '\n';
  const bool same = import.text == before;
  const std::string kept = same ? "" : write_keeping_older(o.machine, import.text);
  for (const std::string& frame : import.frames) std::cout << frame << '\n';
  if (!import.gone_nodes.empty())
    std::cout << "no nodes any more: " << fmt::format("{}", fmt::join(import.gone_nodes, ", ")) << '\n';
  if (!import.gone_frames.empty())
    std::cout << "no frames any more: " << fmt::format("{}", fmt::join(import.gone_frames, ", ")) << '\n';
  if (!import.at_rest.empty())
    std::cout << "move no joint any more, constants at their neutral: "
              << fmt::format("{}", fmt::join(import.at_rest, ", ")) << '\n';
  std::cout << "in " << o.machine << (same ? " (it was so already: nothing changed)" : " (before: " + kept + ")")
            << '\n';
  for (const std::string& step : import.to_do) std::cout << "to do: " << step << '\n';
  if (!same) check_said(o.machine + " has been changed (before: " + kept + ")");
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
        {"--checksum", !o.checksums.empty(), "", "", import},
        {"--period", !o.periods.empty(), "", "", import},
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
            .add_option("--counter", o->counters,
                        "import: the counter of a message that is taken: MESSAGE.SIGNAL, or MESSAGE.SIGNAL=15 where it "
                        "counts from 0 to 14 (repeatable)")
            .one_value_each();
        command
            .add_option("--checksum", o->checksums,
                        "import: its checksum, over all other bytes: MESSAGE.SIGNAL=KIND, one of sum, xor, crc8-j1850, "
                        "crc8-h2f (repeatable)")
            .one_value_each();
        command
            .add_option("--period", o->periods,
                        "import: how often a message comes, in ms, where the DBC does not say it: MESSAGE=20 "
                        "(repeatable)")
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
