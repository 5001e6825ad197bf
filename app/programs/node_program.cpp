#include "app/programs/node_program.h"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <utility>

#include "app/recordings/state_table.h"
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
  JointVector joint_rad = JointVector::Zero(), joint_radps = JointVector::Zero(), spool = JointVector::Zero();
  JointVector cylinder_m = JointVector::Zero();  // pin to pin
  PlanarVector tip_m = PlanarVector::Zero(), tip_force_N = PlanarVector::Zero();
  double payload_kg = 0;

  template <typename Self, typename Visit>
  static void fields(Self& s, Visit&& visit) {
    [[maybe_unused]] const auto& [at, joint_rad, joint_radps, spool, cylinder_m, tip_m, tip_force_N, payload_kg] = s;
    visit("time_ns", s.at);
    visit("joint_rad", s.joint_rad);
    visit("joint_radps", s.joint_radps);
    visit("spool", s.spool);
    visit("cylinder_m", s.cylinder_m);
    visit("tip_m", s.tip_m);
    visit("tip_force_N", s.tip_force_N);
    visit("payload_kg", s.payload_kg);
  }
};

/// All that the loop's thread works on, and what crosses to the thread that tends it.
class NodeRunner {
 public:
  NodeRunner(const NodeSetup& setup, CanBus& bus, const std::atomic<std::uint32_t>& signals, bool wants_rows)
      : machine_(setup.truth, setup.world, setup.start_rad, setup.seed, &bus),
        faults_(setup.faults, setup.truth.machine.bus),
        signals_(signals),
        wants_rows_(wants_rows) {
    for (const std::uint8_t node : setup.left_out) machine_.machine().inject(node, sim::NodeFault::kSilent);
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
    if (wants_rows_ && ticks_++ % kTicksPerRow == 0)
      rows_.push({now, plant.joint_rad, plant.joint_radps, plant.spool, plant.cylinder_m, plant.tip_m, plant.contact_N,
                  plant.payload_kg});
  }

  // The tending thread.
  bool next(FaultEvent& event) noexcept { return fault_events_.pop(event); }
  bool next(sim::WorldEvent& event) noexcept { return world_events_.pop(event); }
  void write(recordings::StateTable& table) {
    TruthRow row;
    while (rows_.pop(row)) table.add(&row);
    table.flush();
  }

  // After the loop has ended.
  [[nodiscard]] double peak_tip_N() const noexcept { return peak_tip_N_; }
  [[nodiscard]] std::uint64_t lost() const noexcept {
    return fault_events_.dropped() + world_events_.dropped() + rows_.dropped();
  }

 private:
  sim::MachineOnBus machine_;
  NodeFaults faults_;
  const std::atomic<std::uint32_t>& signals_;
  bool wants_rows_;
  int ticks_ = 0;
  double peak_tip_N_ = 0;
  std::uint64_t events_read_ = 0;
  Ring<FaultEvent, 64> fault_events_;
  Ring<sim::WorldEvent, 256> world_events_;
  Ring<TruthRow, 1024> rows_;
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
  const auto runner = std::make_unique<NodeRunner>(setup, bus, signals, truth_csv != nullptr);
  std::optional<recordings::StateTable> table;
  if (truth_csv != nullptr) table.emplace(*truth_csv, fields_of<TruthRow>());
  NodeOutcome outcome;
  RunEvents<NodeOutcome::Event> world_events;
  PolicyNote policy("node");
  const RealtimeClock clock;
  {
    RealtimeThread loop({.name = "node", .period = kTick, .fifo_priority = fifo_priority::kMachine}, clock,
                        [&runner](Time now) { runner->step(now); });
    const auto tend = [&](Time now) {
      policy.tell(run.console, now, loop);
      tell(setup, *runner, run.console, outcome, world_events);
      if (table) runner->write(*table);
    };
    tend_until_over(run, clock, tend);
    loop.stop();
    tend(clock.now());
    outcome.loop = loop.report();
  }
  outcome.ran_s = to_seconds(clock.now());
  outcome.peak_tip_N = runner->peak_tip_N();
  outcome.events = world_events.kept();
  outcome.records_lost += runner->lost() + world_events.left_out();
  return outcome;
}

}  // namespace knuckle::programs
