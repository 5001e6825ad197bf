// The other end of a machine's bus as a program: simulated nodes before a simulated machine, in real time, for bringing
// up a bus, a controller, or the machine's side without a machine.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "app/programs/program_console.h"
#include "core/joints.h"
#include "core/time.h"
#include "machine/bus_description.h"
#include "sim/machine_faults.h"
#include "sim/truth.h"
#include "sim/world.h"
#include "transport/can_bus.h"

namespace knuckle::programs {

// What they can be made to do wrong, at a time or at a signal: for trying out how the other side takes it.

struct PlannedFault {
  sim::FaultKind kind = sim::FaultKind::kNodeSilent;  ///< One behind the bus.
  std::uint8_t node = 0;                              ///< 0 where the kind concerns none.
  std::optional<double> at_s;                         ///< nullopt: at every SIGUSR1 at which it is not active.
  double duration_s = std::numeric_limits<double>::infinity();
  std::string text;  ///< As given on the command line.
};
/// "KIND[:NODE]@S[+D]", with usr1 for S at a signal; NODE by name or id.
/// @throws InputError naming --fault, its value and what is wrong with it.
[[nodiscard]] PlannedFault parse_fault(const std::string& text, const BusDescription& bus);

/// A planned fault began or ended.
struct FaultEvent {
  std::size_t fault = 0;  ///< Its place in the plan.
  Time at{};
  bool broken = false;
};

class NodeFaults {
 public:
  /// @param bus as the machine file says.
  NodeFaults(std::vector<PlannedFault> plan, const BusDescription& bus);

  /// Every millisecond, before the machine's step. @param signals SIGUSR1 so far.
  /// @param on_event called with each FaultEvent; must be fit for a step.
  template <typename OnEvent>
  void step(Time now, std::uint32_t signals, sim::MachineOnBus& machine, const OnEvent& on_event) noexcept {
    const bool signalled = signals != signals_seen_;
    signals_seen_ = signals;
    for (std::size_t i = 0; i < plan_.size(); ++i) {
      if (toggle(i, now, signalled, machine)) on_event(FaultEvent{i, now, state_[i].broken});
      if (state_[i].broken) machine_faults_.keep_up(plan_[i].kind, plan_[i].node, machine);
    }
  }

 private:
  struct State {
    bool broken = false, done = false;
    Time at{};
  };
  [[nodiscard]] bool toggle(std::size_t index, Time now, bool signalled, sim::MachineOnBus& machine) noexcept;

  std::vector<PlannedFault> plan_;
  std::vector<State> state_;
  sim::MachineFaults machine_faults_;
  std::uint32_t signals_seen_ = 0;
};

/// A node that is played as a device that is sold.
struct SoldDevice {
  std::uint8_t node = 0;
  std::vector<sim::DeviceObject> dictionary;
  bool lss = true;  ///< Its node id can be set by LSS.
};

struct NodeSetup {
  sim::MachineTruth truth;
  sim::WorldDescription world;
  JointVector start_rad = JointVector::Zero();
  std::uint64_t seed = 1;
  std::vector<std::uint8_t> left_out;  ///< Nodes that are not played: real ones, or none.
  std::vector<SoldDevice> devices;
  double boot_time_s = 0;  ///< Of every node.
  // By the node ids of the machine file.
  std::map<std::uint8_t, std::uint32_t> serials;
  std::map<std::uint8_t, std::uint8_t> first_ids;  ///< Until they are given another; lss::kNoNodeId: none.
  std::vector<PlannedFault> faults;
};

struct NodeOutcome {
  struct Fault {
    std::string text;
    double at_s = 0, mended_at_s = -1;  ///< -1: not ended.
  };
  struct Event {
    std::string what;  ///< Of the world: "contact", "piece_broke", ...
    double at_s = 0, value = 0;
  };
  static constexpr std::size_t kMostFaults = 2000;  ///< Beyond them: lost, and counted.
  std::vector<Fault> faults;
  std::vector<Event> events;  ///< The first of each kind, and the newest others (RunEvents).
  double peak_tip_N = 0;      ///< Largest force of the world on the bucket's tip.
  double ran_s = 0;
  RealtimeReport loop;
  std::uint64_t records_lost = 0;
};

/// @param bus used by the loop's thread alone while this runs. @param signals counts up with every signal to break what
/// waits for one. @param truth_csv a row every 5 ms of the true state; null: not wanted.
/// @throws InputError for a machine or start that cannot be simulated.
[[nodiscard]] NodeOutcome run_node(const NodeSetup& setup, CanBus& bus, const ProgramRun& run,
                                   const std::atomic<std::uint32_t>& signals, std::ostream* truth_csv = nullptr);

}  // namespace knuckle::programs
