#include "app/explain/window.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/cli/interrupt.h"
#include "machine/reason_text.h"
#include "slave/modes.h"
#include "transport/canopen.h"
#include "transport/machine_readings.h"
#include "transport/machine_status.h"

namespace knuckle::explain {

namespace {

using recording::state_in;
using recording::Topic;

constexpr Duration kSameStop = 3s;  // an operator's side that hears nothing has noticed what stopped the machine

bool stopped(Mode mode) {
  return mode == Mode::kFault || mode == Mode::kEStop;
}

/// A stop begins with a fault that was not there in the step before.
class StopFinder {
 public:
  explicit StopFinder(const BusDescription& bus) : bus_(bus) {}
  template <typename State>
  void step(const State& state, Survey& survey) {
    const bool fresh = stopped(state.mode) && (!stopped(mode_) || !same_cause(state.fault, reason_));
    if (fresh && stopped(mode_) && slave::explains(state.fault, reason_, bus_) && !survey.stops.empty()) {
      survey.stops.back().reason = state.fault;  // the same stop, better understood
    } else if (first_ && stopped(state.mode)) {
      survey.begins_stopped = true;
      survey.began_with = state.fault;
    } else if (fresh) {
      survey.stops.push_back({state.at, mode_, state.mode, state.fault});
    }
    first_ = false;
    mode_ = state.mode;
    reason_ = state.fault;
  }

 private:
  const BusDescription& bus_;
  bool first_ = true;
  Mode mode_ = Mode::kOff;
  Reason reason_;
};

void add_unheard(const std::vector<Stop>& unheard, Survey& survey) {
  for (const Stop& stop : unheard) {
    const bool known = std::any_of(survey.stops.begin(), survey.stops.end(), [&](const Stop& other) {
      return other.at <= stop.at + kSameStop && stop.at - other.at <= kSameStop;
    });
    if (!known) survey.stops.push_back(stop);
  }
  std::sort(survey.stops.begin(), survey.stops.end(), [](const Stop& a, const Stop& b) { return a.at < b.at; });
}

bool wanted(Topic topic, Sides sides) {
  const bool machine = topic == Topic::kMachineState || topic == Topic::kMachineWires;
  return machine ? sides.machine_side : sides.operator_side;
}

LinkSeen link_seen(Time at, const recording::WireEvent& event, bool machine_side) {
  LinkSeen seen{at, event.kind, true};
  if (event.kind != WireEventKind::kLinkReceived) return seen;
  seen.understood = machine_side ? decode_master(event.data).has_value() || decode_home(event.data).has_value()
                                 : decode_slave(event.data).has_value() || decode_status(event.data).has_value() ||
                                       decode_readings(event.data).has_value();
  return seen;
}

HidSeen hid_seen(Time at, const recording::WireEvent& event) {
  HidSeen seen;
  seen.at = at;
  seen.kind = event.kind;
  HidReport report{};
  if (event.kind != WireEventKind::kHidReceived || event.data.size() != report.size()) return seen;
  std::copy(event.data.begin(), event.data.end(), report.begin());
  seen.state = decode_state(report);
  seen.sound = seen.state || decode_identity(report);
  const auto last = std::find_if(report.rbegin(), report.rend(), [](std::uint8_t byte) { return byte != 0; });
  seen.zeros = static_cast<int>(last - report.rbegin());
  return seen;
}

void add_wires(const recording::StepWires& step, bool machine_side, Window& window) {
  (machine_side ? window.machine_steps : window.operator_steps).push_back({step.at, step.step});
  for (const recording::WireEvent& event : step.events) {
    switch (event.kind) {
      case WireEventKind::kCanReceived:
      case WireEventKind::kCanSent:
      case WireEventKind::kCanRefused:
        window.can.push_back({step.at, event.kind, can_frame(event)});
        break;
      case WireEventKind::kHidReceived:
      case WireEventKind::kHidSent:
      case WireEventKind::kHidRefused:
        window.hid.push_back(hid_seen(step.at, event));
        break;
      case WireEventKind::kLinkReceived:
      case WireEventKind::kLinkSent:
      case WireEventKind::kLinkRefused:
        (machine_side ? window.machine_link : window.operator_link).push_back(link_seen(step.at, event, machine_side));
        break;
      case WireEventKind::kCanState:
      case WireEventKind::kHidConnected:
      case WireEventKind::kCanAcknowledged:
        window.changes.push_back({step.at, event.kind, event.value});
        break;
      default:
        break;
    }
  }
}

}  // namespace

Survey find_stops(recording::Recording& recording, Sides sides, const BusDescription& bus) {
  Survey survey;
  const bool has_machine = recording.head().has_machine && sides.machine_side;
  StopFinder finder(bus);
  std::vector<Stop> unheard;
  bool silent = false, any = false;
  while (const auto entry = recording.next()) {
    cli::check_interrupt();
    const bool machine = entry->topic == Topic::kMachineState;
    if ((!machine && entry->topic != Topic::kOperatorState) || !wanted(entry->topic, sides)) continue;
    if (!any) survey.first = entry->at;
    any = true;
    survey.last = std::max(survey.last, entry->at);
    ++(machine ? survey.machine_steps : survey.operator_steps);
    if (machine) {
      finder.step(state_in<slave::SlaveState>(*entry, recording), survey);
      continue;
    }
    const auto state = state_in<master::MasterState>(*entry, recording);
    if (!has_machine) finder.step(state, survey);
    const bool silent_now = state.warning.code == ReasonCode::kCuesSilence;
    if (silent_now && !silent) unheard.push_back({state.at, state.mode, state.mode, state.warning, true});
    silent = silent_now;
  }
  add_unheard(unheard, survey);
  return survey;
}

Window load_window(recording::Recording& recording, Sides sides, Time from, Time to) {
  Window window;
  window.from = from;
  window.to = from;
  recording.seek(from);
  while (const auto entry = recording.next()) {
    cli::check_interrupt();
    if (entry->at < from || !wanted(entry->topic, sides)) continue;
    if (entry->at > to) {
      // Chunks of the two loops overlap a little; what is long past the end is past it for both.
      if (entry->at > to + 1s) break;
      continue;
    }
    window.to = std::max(window.to, entry->at);
    switch (entry->topic) {
      case Topic::kMachineState:
        window.machine.push_back(state_in<slave::SlaveState>(*entry, recording));
        break;
      case Topic::kOperatorState:
        window.operator_states.push_back(state_in<master::MasterState>(*entry, recording));
        break;
      case Topic::kMachineWires:
      case Topic::kOperatorWires:
        if (const auto wires = recording::decode_wires(entry->data, recording.head().link_version))
          add_wires(*wires, entry->topic == Topic::kMachineWires, window);
        break;
      default:
        break;
    }
  }
  return window;
}

std::string at_text(Time at) {
  return fmt::format("{:.3f} s", to_seconds(at));
}

std::string span_text(Duration span) {
  const double seconds = to_seconds(span);
  return seconds < 10 ? fmt::format("{:.0f} ms", 1e3 * seconds) : fmt::format("{:.1f} s", seconds);
}

std::string reason_text(const MachineDescription& machine, const Reason& reason) {
  std::string line = text(reason, machine.bus);
  if (reason.code == ReasonCode::kNodeEmergency) {
    const auto code = static_cast<std::uint16_t>(reason.value);
    line += fmt::format(": 0x{:04X}, {}", code, canopen::emergency_text(code));
  }
  return line;
}

}  // namespace knuckle::explain
