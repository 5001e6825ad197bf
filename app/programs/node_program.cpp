#include "app/programs/node_program.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "app/cli/command.h"
#include "app/recordings/csv_mapping.h"
#include "app/recordings/state_table.h"
#include "app/session/loop_views.h"
#include "core/fields.h"
#include "core/loop_table.h"
#include "core/ring.h"
#include "machine/bus_description.h"
#include "machine/load.h"
#include "sim/machine_on_bus.h"

namespace knuckle::programs {
namespace {

constexpr double kLatest_s = 1e6;

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
  cli::refuse_option("--fault", text, why);
}

double seconds_in(const std::string& text, const std::string& cell, const char* what) {
  const double value = recordings::number_in(cell);
  if (std::isfinite(value) && value >= 0 && value <= kLatest_s) return value;
  refuse(text, std::string(what) + " \"" + cell + "\" must be seconds from 0 to 1e6");
}

std::uint8_t node_in(const std::string& text, const std::string& cell, sim::FaultKind kind, const BusDescription& bus) {
  const auto id = cli::whole_number(cell, 127);
  const NodeDescription* const found = id ? bus.find(static_cast<std::uint8_t>(*id)) : bus.find(cell);
  if (found == nullptr) refuse(text, "no node \"" + cell + "\"; there are " + bus.node_names());
  const std::uint8_t node = found->id;
  if (const char* const why = sim::why_not(kind, node, bus)) refuse(text, why);
  return node;
}

}  // namespace

PlannedFault parse_fault(const std::string& text, const BusDescription& bus) {
  PlannedFault fault;
  fault.text = text;
  const auto at = text.find('@');
  if (at == std::string::npos) refuse(text, "must be KIND[:NODE]@S[+D], such as node_silent:boom_valve@10+2");
  const std::string what = text.substr(0, at), when = text.substr(at + 1);
  const auto colon = what.find(':');
  const std::string kind = what.substr(0, colon);
  const auto named = sim::fault_named(kind);
  if (!named || !sim::behind_bus(*named))
    refuse(text, "no fault \"" + kind + "\"; there are " + sim::fault_names(sim::behind_bus));
  fault.kind = *named;
  const bool given = colon != std::string::npos;
  if (sim::concerns_node(fault.kind) != given)
    refuse(text, given ? kind + " takes no node" : "needs a node: " + kind + ":NODE@S");
  if (given) fault.node = node_in(text, what.substr(colon + 1), fault.kind, bus);
  const auto plus = when.find('+');
  const std::string start = when.substr(0, plus);
  if (start != "usr1") fault.at_s = seconds_in(text, start, "start");
  if (plus != std::string::npos) fault.duration_s = seconds_in(text, when.substr(plus + 1), "duration");
  return fault;
}

NodeFaults::NodeFaults(std::vector<PlannedFault> plan, const BusDescription& bus)
    : plan_(std::move(plan)), state_(plan_.size()), machine_faults_(bus, worst_bus_load(bus)) {}

bool NodeFaults::toggle(std::size_t index, Time now, bool signalled, sim::MachineOnBus& machine) noexcept {
  const PlannedFault& fault = plan_[index];
  State& state = state_[index];
  if (state.broken) {
    if (to_seconds(now - state.at) < fault.duration_s) return false;
  } else {
    const bool due = fault.at_s ? to_seconds(now) >= *fault.at_s : signalled;
    if (state.done || !due) return false;
  }
  state.broken = !state.broken;
  state.at = now;
  state.done = fault.at_s.has_value();
  machine_faults_.set(fault.kind, fault.node, state.broken, machine);
  return true;
}

namespace {

constexpr int kTicksPerRow = 5;

/// The simulation's true state, known to no controller.
struct TruthRow {
  Time at{};
  session::Truth truth;
  JointVector cylinder_m = JointVector::Zero();  // pin to pin

  template <typename Self, typename Visit>
  static void fields(Self& s, Visit&& visit) {
    [[maybe_unused]] const auto& [at, truth, cylinder_m] = s;
    visit("time_ns", s.at);
    visit("", s.truth);
    visit("cylinder_m", s.cylinder_m);
  }
};

/// All that the loop's thread works on, and what crosses to the thread that tends it.
class NodeRunner {
 public:
  NodeRunner(const NodeSetup& setup, CanBus& bus, const std::atomic<std::uint32_t>& signals, std::ostream* truth_csv)
      : machine_(setup.truth, setup.world, setup.start_rad, setup.seed, &bus),
        faults_(setup.faults, setup.truth.machine.bus),
        signals_(signals),
        rows_(truth_csv, kTicksPerRow) {
    sim::CanNodes& nodes = machine_.machine().nodes();
    for (const SoldDevice& device : setup.devices) {
      nodes.node(device.node)->become(device.dictionary);
      if (!device.lss) nodes.node(device.node)->remove_lss();
    }
    for (const NodeDescription& node : setup.truth.machine.bus.nodes)
      nodes.node(node.id)->set_boot_time(from_seconds(setup.boot_time_s));
    for (const std::uint8_t node : setup.left_out) machine_.machine().inject(node, sim::NodeFault::kSilent);
    for (const auto& [node, serial] : setup.serials) nodes.node(node)->set_serial(serial);
    for (const auto& [node, id] : setup.first_ids) nodes.node(node)->start_as(id);  // last: nodes are found by their id
  }

  // The loop's thread.
  void step(Time now) noexcept {
    // Nodes have no operator whom to ask: restarted after a bus-off, they are there again.
    if (machine_.nodes_end().state() == CanState::kBusOff) machine_.nodes_end().acknowledge();
    faults_.step(now, signals_.load(std::memory_order_relaxed), machine_,
                 [this](const FaultEvent& event) { fault_events_.push(event); });
    machine_.step(now);
    const sim::PlantState& plant = machine_.plant();
    for (; events_read_ < plant.events.count; ++events_read_) world_events_.push(plant.events.at(events_read_));
    peak_tip_N_ = std::max(peak_tip_N_, plant.contact_N.norm());
    if (rows_.due()) rows_.push({now, session::truth_of(plant), plant.cylinder_m});
  }

  // The tending thread.
  bool next(FaultEvent& event) noexcept { return fault_events_.pop(event); }
  bool next(sim::WorldEvent& event) noexcept { return world_events_.pop(event); }
  void write() { rows_.write(); }

  // After the loop has ended.
  [[nodiscard]] double peak_tip_N() const noexcept { return peak_tip_N_; }
  [[nodiscard]] std::uint64_t lost() const noexcept {
    return fault_events_.dropped() + world_events_.dropped() + rows_.lost();
  }

 private:
  sim::MachineOnBus machine_;
  NodeFaults faults_;
  const std::atomic<std::uint32_t>& signals_;
  double peak_tip_N_ = 0;
  std::uint64_t events_read_ = 0;
  Ring<FaultEvent, 64> fault_events_;
  Ring<sim::WorldEvent, 256> world_events_;
  RowTable<TruthRow> rows_;
};

/// Injected faults and events of the world, shown and recorded.
void tell(const NodeSetup& setup, NodeRunner& runner, ProgramConsole& console, NodeOutcome& outcome,
          RunEvents<NodeOutcome::Event>& world_events) {
  FaultEvent fault;
  while (runner.next(fault)) {
    const std::string& text = setup.faults[fault.fault].text;
    console.event(fault.at, (fault.broken ? "fault injected: " : "fault ended: ") + text);
    if (fault.broken) {
      if (outcome.faults.size() == NodeOutcome::kMostFaults) {
        ++outcome.records_lost;
        continue;
      }
      outcome.faults.push_back({text, to_seconds(fault.at)});
      continue;
    }
    const auto last = std::find_if(outcome.faults.rbegin(), outcome.faults.rend(),
                                   [&](const NodeOutcome::Fault& f) { return f.text == text; });
    if (last != outcome.faults.rend()) last->mended_at_s = to_seconds(fault.at);
  }
  sim::WorldEvent event;
  while (runner.next(event)) {
    console.event(Time(from_seconds(event.t_s)), sim::name(event.kind));
    world_events.add({sim::name(event.kind), event.t_s, event.value}, sim::name(event.kind));
  }
}

}  // namespace

NodeOutcome run_node(const NodeSetup& setup, CanBus& bus, const ProgramRun& run,
                     const std::atomic<std::uint32_t>& signals, std::ostream* truth_csv) {
  const auto runner = std::make_unique<NodeRunner>(setup, bus, signals, truth_csv);
  NodeOutcome outcome;
  RunEvents<NodeOutcome::Event> world_events;
  const LoopRun ran =
      run_loop(run, {.thread = {.name = "node", .period = kTick, .fifo_priority = fifo_priority::kMachine},
                     .step = [&runner](Time now) { runner->step(now); },
                     .tend =
                         [&](Time) {
                           tell(setup, *runner, run.console, outcome, world_events);
                           runner->write();
                         },
                     .ask_to_stop = {}});
  outcome.loop = ran.report;
  outcome.ran_s = to_seconds(ran.ended_at);
  outcome.peak_tip_N = runner->peak_tip_N();
  outcome.events = world_events.kept();
  outcome.records_lost += runner->lost() + world_events.left_out();
  return outcome;
}

}  // namespace knuckle::programs
