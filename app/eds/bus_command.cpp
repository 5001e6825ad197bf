#include "app/eds/bus_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cerrno>
#include <filesystem>
#include <iostream>
#include <optional>
#include <tuple>
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
  std::string action, file, id, as, machine, can, from;
  std::optional<std::uint32_t> serial;
  std::vector<std::string> by_objects;
  ImportOptions wanted;
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

/// The machine file's text, where it may be changed by what is in FILE.
std::string text_to_change(const BusOptions& o) {
  cli::Places places;
  if (!o.file.empty()) cli::check_readable("FILE", o.file);
  places.input("FILE", o.file);
  if (std::error_code none; !std::filesystem::exists(o.machine, none) && has_config("machine", o.machine)) {
    cli::refuse_option("--machine", o.machine,
                       "is a machine that comes with Knuckle: copy its file first: cp " +
                           find_config("machine", o.machine) + " my_machine.toml");
  }
  cli::check_readable("--machine", o.machine);
  places.configuration_output("--machine", o.machine);
  return whole_file(o.machine, kLargestMachine_MB);
}

void print_notes(const std::string& file, const std::vector<std::string>& notes) {
  for (const std::string& note : notes) std::cout << "note: " << file << ": " << note << '\n';
}

/// Those of an older file become tables before anything else is changed.
void note_node_tables(const std::string& before, const std::string& machine) {
  if (with_node_tables(before, machine) != before)
    std::cout << "note: " << machine << ": its nodes are [[bus.node]] tables from now on\n";
}

/// What was said must be readable, or what was done is said in the one line that then is.
/// @throws InputError
void check_said(const std::string& done) {
  const cli::InterruptGuard pipes_only_fail;
  errno = 0;
  if (std::cout.flush() || errno == EPIPE || errno == EBADF) return;  // nobody wanted to read it
  throw InputError("standard output: cannot be written; " + done);
}

/// Writes the machine file where it changes, and says what has been done. @param done its lines; what the older file is
/// called now goes behind the last one. @return the exit code
int finish(const std::string& machine, const std::string& before, const std::string& after, const std::string& done,
           const std::vector<std::string>& to_do) {
  const bool same = after == before;
  std::string kept = "it was so already: nothing changed";
  if (!same) {
    cli::OutputFile out("--machine", machine);
    out.stream() << after;
    kept = "before: " + out.commit_keeping_older();
  }
  std::cout << done << " (" << kept << ")\n";
  for (const std::string& step : to_do) std::cout << "to do: " << step << '\n';
  if (!same) check_said(machine + " has been changed (" + kept + ")");
  return 0;
}

int add(const BusOptions& o) {
  const std::uint8_t id = cli::node_id("--id", o.id);
  const std::string before = text_to_change(o);
  const DeviceFile device = read_device_file(o.file);
  const std::string text = with_device(before, o.machine, o.as, id, device);
  const MachineDescription machine = parse_machine(text, o.machine);
  const std::string node = named_node(machine.bus, o.as, o.machine).name;
  const Fit fit = fit_of(device, machine, node);
  print_notes(o.file, device.slips);
  print_notes(o.file, fit.notes);
  if (const std::string lacks = missing_status_text(*machine.bus.find(node), machine); !lacks.empty())
    std::cout << "note: " << node << ' ' << lacks << '\n';
  for (const std::string& obstacle : fit.obstacles)
    std::cerr << "knuckle: " << node << " cannot be this device: " << obstacle << '\n';
  if (!fit.obstacles.empty()) {
    std::cerr << "knuckle: " << o.machine << " is as it was\n";
    return 2;
  }
  note_node_tables(before, o.machine);
  return finish(
      o.machine, before, text,
      fmt::format("{} is {} {}, node 0x{:02X}, in {}", node, device.vendor_name, device.product_name, id, o.machine),
      fit.to_set);
}

int migrate(const BusOptions& o) {
  const std::string before = text_to_change(o), text = with_node_tables(before, o.machine);
  const std::string done = o.machine + ": its nodes are [[bus.node]] tables";
  if (text != before) return finish(o.machine, before, text, done, {});
  std::cout << done << " already: nothing changed\n";
  return 0;
}

int import_dbc(const BusOptions& o) {
  const Wanted wanted = wanted_of(o.wanted);
  const std::string before = text_to_change(o);
  const DbcFile dbc = read_dbc(o.file);
  const Import import = with_frames(before, o.machine, dbc, wanted);
  note_node_tables(before, o.machine);
  print_notes(o.file, dbc.slips);
  std::string done;
  for (const std::string& frame : import.frames) done += frame + '\n';
  for (const auto& [what, names] : {std::pair{"no nodes any more", &import.gone_nodes},
                                    {"no frames any more", &import.gone_frames},
                                    {"move no joint any more, constants at their neutral", &import.at_rest}})
    if (!names->empty()) done += fmt::format("{}: {}\n", what, fmt::join(*names, ", "));
  return finish(o.machine, before, import.text, done + "in " + o.machine, import.to_do);
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
    std::string value, actions;  ///< The actions that know it; those that need it with "!".
  };
  for (const auto& [name, given, value, actions] :
       {Option{"FILE", !o.file.empty(), o.file, "add! import!"},
        {"--id", !o.id.empty(), o.id, "add! assign-id!"},
        {"--as", !o.as.empty(), o.as, "add!"},
        {"--machine", !o.machine.empty(), o.machine, "add! import! migrate! assign-id"},
        {"--signal", !o.wanted.signals.empty(), "", "import"},
        {"--command", !o.wanted.commands.empty(), "", "import"},
        {"--constant", !o.wanted.constants.empty(), "", "import"},
        {"--counter", !o.wanted.counters.empty(), "", "import"},
        {"--checksum", !o.wanted.checksums.empty(), "", "import"},
        {"--period", !o.wanted.periods.empty(), "", "import"},
        {"--bus", !o.wanted.bus.empty(), o.wanted.bus, "import"},
        {"--can", !o.can.empty(), o.can, "assign-id!"},
        {"--from", !o.from.empty(), o.from, "assign-id"},
        {"--serial", o.serial.has_value(), "", "assign-id"},
        {"--by-object", !o.by_objects.empty(), "", "assign-id"}}) {
    if (!given && actions.find(o.action + "!") != std::string::npos)
      cli::refuse_option(name, "", "is required by bus " + o.action);
    if (given && actions.find(o.action) == std::string::npos)
      cli::refuse_option(name, value, "does not go with bus " + o.action);
  }
}

int run_bus(const BusOptions& o) {
  check_options(o);
  if (o.action == "add") return add(o);
  if (o.action == "import") return import_dbc(o);
  return o.action == "assign-id" ? assign(o) : migrate(o);
}

void add_options(const cli::OptionList& command, BusOptions& o) {
  command
      .add_option("ACTION", o.action,
                  "assign-id: gives the device on the bus a node id. add: puts a device into the machine file. "
                  "import: puts frames from and to the machine's own controller into it. migrate: writes [bus.nodes] "
                  "as [[bus.node]] tables")
      .required()
      .one_of({"assign-id", "add", "import", "migrate"});
  command.add_option("FILE", o.file,
                     "add: the device's file from its vendor (.eds). import: the machine's from its maker (.dbc)");
  command.add_option("--id", o.id, "add, assign-id: node id of the device, 1 to 127 or 0x01 to 0x7F");
  command.add_option("--as", o.as, "add: name of the node whose place it takes: boom_valve, tilt, ...");
  for (const auto& [name, values, about] :
       {std::tuple{"--signal", &o.wanted.signals,
                   "import: a signal and where it is: boom_angle=MESSAGE.SIGNAL, as the DBC calls them"},
        {"--command", &o.wanted.commands,
         "import: what moves a joint, with its values at full speed: boom=MESSAGE.SIGNAL:extend=0.4,retract=-0.4"},
        {"--constant", &o.wanted.constants,
         "import: what another signal of such a message rests at: MESSAGE.SIGNAL=NEUTRAL, or NEUTRAL,LED where it is "
         "LED while an operator leads; MESSAGE=NEUTRAL for all others"},
        {"--counter", &o.wanted.counters,
         "import: the counter of a message that is taken: MESSAGE.SIGNAL, or MESSAGE.SIGNAL=15 where it counts from 0 "
         "to 14"},
        {"--checksum", &o.wanted.checksums,
         "import: its checksum, over all other bytes: MESSAGE.SIGNAL=KIND, one of sum, xor, crc8-j1850, crc8-h2f"},
        {"--period", &o.wanted.periods,
         "import: how often a message comes, in ms, where the DBC does not say it: MESSAGE=20"}})
    command.add_option(name, *values, std::string(about) + " (repeatable)").one_value_each();
  command.add_option("--bus", o.wanted.bus,
                     "import: on which bus: its name in the machine file; NAME=KBPS makes a second one");
  command.add_option("--machine", o.machine,
                     "add, import, migrate: machine file (.toml) that is changed; as it was, it is kept as "
                     "FILE.N.toml. assign-id: name or file of the machine whose node it is to be");
  command.add_option("--can", o.can, "assign-id: CAN interface");
  command.add_option("--from", o.from, "assign-id: node id that it has now (default: the one device that answers LSS)");
  command.add_option("--serial", o.serial, "assign-id: of several equal devices with LSS, the one to change");
  command
      .add_option("--by-object", o.by_objects,
                  "assign-id: object of the device that holds its node id, instead of LSS: 0x20F0 or 0x20F0:01")
      .one_value_each();
}

}  // namespace

cli::Command bus_entry() {
  return cli::command<BusOptions>(
      "bus",
      "Puts a device that is sold, or frames of the machine's own controller, into a machine file; gives node ids",
      add_options, run_bus);
}

}  // namespace knuckle::eds
