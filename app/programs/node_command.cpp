#include <algorithm>
#include <csignal>
#include <limits>
#include <optional>
#include <sstream>
#include <utility>

#include "app/bringup/can_interfaces.h"
#include "app/bringup/planned_faults.h"
#include "app/cli/interrupt.h"
#include "app/cli/json.h"
#include "app/eds/device_file.h"
#include "app/programs/node_program.h"
#include "app/programs/program_frame.h"
#include "app/programs/programs.h"
#include "app/session/scenario.h"
#include "app/session/truth_file.h"
#include "machine/bus_description.h"
#include "machine/load.h"
#include "transport/lss.h"

namespace knuckle::programs {
namespace {

using cli::Json;
constexpr const char* kSchema = "knuckle-node/1";

struct Options {
  std::string machine = "solar015", scenario = "free_motion", nodes = "all", truth, family;
  std::uint64_t seed = 1;
  std::vector<std::string> can, faults, devices, serials, first_ids;
  std::optional<double> boot_time_s;
  RunOptions run;
};

std::atomic<std::uint32_t> user_signals{0};  // a handler can reach nothing else
static_assert(std::atomic<std::uint32_t>::is_always_lock_free);

/// While one lives, SIGUSR1 is counted.
class UserSignal {
 public:
  UserSignal() noexcept : previous_(std::signal(SIGUSR1, [](int) { ++user_signals; })) {}
  ~UserSignal() { std::signal(SIGUSR1, previous_); }
  UserSignal(const UserSignal&) = delete;
  UserSignal& operator=(const UserSignal&) = delete;

 private:
  void (*previous_)(int);
};

void add_options(const cli::OptionList& c, Options& o) {
  c.add_option("--can", o.can, "CAN interface, such as vcan0; of two buses NAME=INTERFACE for each")
      .one_value_each()
      .required();
  c.add_option("--machine", o.machine, "Machine name or .toml file").show_default();
  c.add_option("--scenario", o.scenario, "Scenario that gives the machine's start and surroundings: name or .toml file")
      .show_default();
  c.add_option("--seed", o.seed, "Random seed of the machine's true parameters").show_default().check(cli::seed_error);
  c.add_option("--family", o.family, "Machines that the seed samples from: smooth (default), serviced or worn");
  c.add_option("--truth", o.truth, "The machine's true parameters (.toml), instead of sampling them from the seed");
  c.add_option("--nodes", o.nodes, "Nodes to simulate: all, or names separated by commas, such as boom_valve,tilt")
      .show_default();
  c.add_option("--eds", o.devices, "Play a node as a device that is sold: NODE=FILE, such as boom_valve=valve.eds")
      .one_value_each();
  c.add_option("--serial", o.serials, "Serial number of a node: NODE=NUMBER").one_value_each();
  c.add_option("--node-id", o.first_ids,
               "Node id that a node has at first, as delivered: NODE=ID, or NODE=none (knuckle bus assign-id)")
      .one_value_each();
  c.add_option("--boot-time", o.boot_time_s, "How long every node boots, in seconds (default: 0)");
  c.add_option("--fault", o.faults,
               "Inject a fault: KIND[:NODE or :BUS]@S[+D], from S seconds on (usr1: at SIGUSR1) for D seconds")
      .one_value_each();
  o.run.add(c, "Write the simulation's true state as CSV, a row every 5 ms",
            "Write counters and events as JSON (described in docs/programs.md)");
}

void check(const Options& o) {
  o.run.check();
  cli::check_range("--boot-time", o.boot_time_s, 0.0, 60.0, " s");
  if (!o.truth.empty()) cli::check_readable("--truth", o.truth);
  cli::Places places;
  places.configuration("--machine", o.machine);
  places.configuration("--scenario", o.scenario);
  places.input("--truth", o.truth);
  o.run.take(places);
}

/// Ids of the nodes that are not played.
std::vector<std::uint8_t> left_out(const std::string& asked, const BusDescription& bus) {
  std::vector<std::uint8_t> out;
  if (asked == "all") return out;
  std::vector<const NodeDescription*> played;
  std::istringstream list(asked);
  for (std::string name; std::getline(list, name, ',');) {
    played.push_back(bus.find(name));
    if (played.back() == nullptr)
      cli::refuse_option("--nodes", asked, "no node \"" + name + "\"; there are all, " + bus.node_names());
  }
  for (const NodeDescription& node : bus.nodes) {
    if (std::find(played.begin(), played.end(), &node) == played.end()) out.push_back(node.id);
  }
  return out;
}

/// Of NODE=VALUE. @return the node's id, and the value
std::pair<std::uint8_t, std::string> of_node(const char* option, const std::string& asked, const BusDescription& bus) {
  const auto equals = asked.find('=');
  const NodeDescription* const node = bus.find(asked.substr(0, equals));
  if (equals == std::string::npos || node == nullptr)
    cli::refuse_option(option, asked, "must be NODE=...; nodes are " + bus.node_names());
  return {node->id, asked.substr(equals + 1)};
}

SoldDevice sold_device(const std::string& asked, const BusDescription& bus) {
  const auto [node, file] = of_node("--eds", asked, bus);
  cli::check_readable("--eds", file);
  const eds::DeviceFile device = eds::read_device_file(file);
  return {node, eds::dictionary(device, node), device.lss};
}

void identify_nodes(const Options& o, const BusDescription& bus, NodeSetup& setup) {
  for (const std::string& asked : o.serials) {
    const auto [node, text] = of_node("--serial", asked, bus);
    const auto serial = cli::whole_number(text, std::numeric_limits<std::uint32_t>::max());
    if (!serial) cli::refuse_option("--serial", asked, "must be a number of 32 bits");
    setup.serials[node] = *serial;
  }
  for (const std::string& asked : o.first_ids) {
    const auto [node, text] = of_node("--node-id", asked, bus);
    setup.first_ids[node] = text == "none" ? lss::kNoNodeId : cli::node_id("--node-id", text);
  }
}

NodeSetup set_up(const Options& o) {
  const MachineDescription machine = load_machine(find_config("machine", o.machine));
  const session::Scenario scenario = session::load_scenario(find_config("scenario", o.scenario), machine);
  NodeSetup setup;
  setup.truth = session::truth_for(machine, o.truth, o.family, o.seed);
  setup.world = scenario.world;
  setup.start_rad = scenario.start_rad;
  setup.seed = o.seed;
  setup.left_out = left_out(o.nodes, machine.bus);
  for (const std::string& device : o.devices) setup.devices.push_back(sold_device(device, machine.bus));
  identify_nodes(o, machine.bus, setup);
  setup.boot_time_s = o.boot_time_s.value_or(0);
  for (const std::string& fault : o.faults) setup.faults.push_back(bringup::parse_fault(fault, machine.bus));
  return setup;
}

Json result_json(const Options& o, const NodeOutcome& outcome) {
  Json json{{"machine", o.machine}, {"can", bringup::can_text(o.can)}, {"scenario", o.scenario}, {"seed", o.seed}};
  json["faults"] = Json::array();
  for (const auto& fault : outcome.faults)
    json["faults"].push_back({{"fault", fault.text},
                              {"at_s", fault.at_s},
                              {"mended_at_s", fault.mended_at_s < 0 ? Json() : Json(fault.mended_at_s)}});
  json["events"] = Json::array();
  for (const auto& event : outcome.events)
    json["events"].push_back({{"what", event.what}, {"at_s", event.at_s}, {"value", event.value}});
  json["peak_tip_force_N"] = outcome.peak_tip_N;
  json["realtime"] = {{"node", loop_json(outcome.loop)}};
  return json;
}

int run(const Options& o) {
  check(o);
  const cli::InterruptGuard interrupt;
  const UserSignal user_signal;
  const NodeSetup setup = set_up(o);
  ProgramFrame program("knuckle node", o.run, interrupt);
  const auto interfaces = bringup::open_interfaces(o.can, setup.truth.machine.bus);

  program.console.note("simulates " + (o.nodes == "all" ? "all nodes" : o.nodes) + " of " + o.machine + " on " +
                       bringup::can_text(o.can));
  const NodeOutcome outcome = run_node(setup, interfaces->bus(), program.start(), user_signals, program.csv.stream());
  program.console.notes(interfaces->diagnoses());
  program.finish(kSchema, result_json(o, outcome), outcome.ran_s, outcome.records_lost);
  return 0;
}

}  // namespace

cli::Command node_entry() {
  return cli::command<Options>("node", "Simulated machine: the nodes of its bus on a CAN interface", add_options, run);
}

}  // namespace knuckle::programs
