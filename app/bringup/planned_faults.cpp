#include "app/bringup/planned_faults.h"

#include <cmath>
#include <utility>

#include "app/cli/command.h"
#include "app/recordings/csv_cells.h"
#include "machine/bus_budget.h"

namespace knuckle::bringup {
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

std::uint8_t frame_in(const std::string& text, const std::string& cell, sim::FaultKind kind,
                      const BusDescription& bus) {
  const auto found = sim::frame_subject(cell, bus);
  if (!found) refuse(text, "no frame or signal \"" + cell + "\"; there are " + sim::frame_subject_names(bus));
  if (const char* const why = sim::why_not(kind, *found, bus)) refuse(text, why);
  return *found;
}

std::uint8_t bus_in(const std::string& text, const std::string& cell, const BusDescription& bus) {
  const auto found = bus.line_named(cell);
  if (!found) refuse(text, "no bus \"" + cell + "\"" + (bus.second ? "; there are " + bus.line_names() : ""));
  return static_cast<std::uint8_t>(*found);
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
  const bool given = colon != std::string::npos, of_bus = sim::concerns_bus(fault.kind) && bus.second;
  if (of_bus && !given) refuse(text, "needs a bus: " + kind + ":BUS@S; there are " + bus.line_names());
  const bool of_frame = sim::concerns_frame(fault.kind);
  if (!of_bus && (of_frame || sim::concerns_node(fault.kind)) != given)
    refuse(text, given      ? kind + " takes no node"
                 : of_frame ? "needs a frame or a signal: " + kind + ":FRAME@S"
                            : "needs a node: " + kind + ":NODE@S");
  if (of_bus)
    fault.node = bus_in(text, what.substr(colon + 1), bus);
  else if (of_frame)
    fault.node = frame_in(text, what.substr(colon + 1), fault.kind, bus);
  else if (given)
    fault.node = node_in(text, what.substr(colon + 1), fault.kind, bus);
  const auto plus = when.find('+');
  const std::string start = when.substr(0, plus);
  if (start != "usr1") fault.at_s = seconds_in(text, start, "start");
  if (plus != std::string::npos) fault.duration_s = seconds_in(text, when.substr(plus + 1), "duration");
  return fault;
}

NodeFaults::NodeFaults(std::vector<PlannedFault> plan, const BusDescription& bus)
    : plan_(std::move(plan)), state_(plan_.size()), machine_faults_(bus, worst_bus_loads(bus)) {}

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

}  // namespace knuckle::bringup
