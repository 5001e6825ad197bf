// What a simulated machine is made to do wrong, at a time or at a signal: for trying out how the other side takes it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/time.h"
#include "machine/bus_description.h"
#include "sim/machine_faults.h"
#include "sim/machine_on_bus.h"

namespace knuckle::bringup {

struct PlannedFault {
  sim::FaultKind kind = sim::FaultKind::kNodeSilent;  ///< One behind the bus.
  std::uint8_t node = 0;                              ///< Or of two buses which, or sim::frame_subject(); 0 for none.
  std::optional<double> at_s;                         ///< nullopt: at every SIGUSR1 at which it is not active.
  double duration_s = std::numeric_limits<double>::infinity();
  std::string text;  ///< As given on the command line.
};
/// "KIND[:NODE]@S[+D]", with usr1 for S at a signal; NODE by name or id, or the name of one of two buses, of a frame or
/// of a signal.
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

}  // namespace knuckle::bringup
