#include "app/programs/node_program.h"

#include <algorithm>
#include <memory>

#include "app/recordings/state_table.h"
#include "app/session/loop_views.h"
#include "core/fields.h"
#include "core/loop_table.h"
#include "core/ring.h"
#include "sim/machine_on_bus.h"

namespace knuckle::programs {
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
                 [this](const bringup::FaultEvent& event) { fault_events_.push(event); });
    machine_.step(now);
    const sim::PlantState& plant = machine_.plant();
    for (; events_read_ < plant.events.count; ++events_read_) world_events_.push(plant.events.at(events_read_));
    peak_tip_N_ = std::max(peak_tip_N_, plant.contact_N.norm());
    if (rows_.due()) rows_.push({now, session::truth_of(plant), plant.cylinder_m});
  }

  // The tending thread.
  bool next(bringup::FaultEvent& event) noexcept { return fault_events_.pop(event); }
  bool next(sim::WorldEvent& event) noexcept { return world_events_.pop(event); }
  void write() { rows_.write(); }

  // After the loop has ended.
  [[nodiscard]] double peak_tip_N() const noexcept { return peak_tip_N_; }
  [[nodiscard]] std::uint64_t lost() const noexcept {
    return fault_events_.dropped() + world_events_.dropped() + rows_.lost();
  }

 private:
  sim::MachineOnBus machine_;
  bringup::NodeFaults faults_;
  const std::atomic<std::uint32_t>& signals_;
  double peak_tip_N_ = 0;
  std::uint64_t events_read_ = 0;
  Ring<bringup::FaultEvent, 64> fault_events_;
  Ring<sim::WorldEvent, 256> world_events_;
  RowTable<TruthRow> rows_;
};

/// Injected faults and events of the world, shown and recorded.
void tell(const NodeSetup& setup, NodeRunner& runner, ProgramConsole& console, NodeOutcome& outcome,
          RunEvents<NodeOutcome::Event>& world_events) {
  bringup::FaultEvent fault;
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
