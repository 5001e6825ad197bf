#include "app/explain/cause.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/explain/window.h"
#include "machine/bus_description.h"
#include "machine/pilot_spool.h"
#include "machine/reason_text.h"

namespace knuckle::explain {

std::string own_guard_text(const BusDescription& bus) {
  if (!bus.by_frames()) return "";
  const auto sure = [](const GuardProof& proof) {
    return proof.proved && proof.changed == GuardProof::Changed::kNothing;
  };
  const bool own = moves_joints(bus, kOwnController);
  const bool proved = own ? sure(bus.commands_guard)
                          : std::all_of(bus.nodes.begin(), bus.nodes.end(), [&](const NodeDescription& node) {
                              return !moves_joints(bus, node.id) || sure(node.guard);
                            });
  return fmt::format("{} ends all motion {:.0f} ms after the last one{}",
                     own ? "the machine's own controller" : "the module with its outputs", 1e3 * bus.valve_watchdog_s,
                     proved ? "" : ", which is not proved: knuckle commission proves it");
}

namespace {

std::optional<Cause> loop_paused(const Stop& stop, const Evidence& evidence, const MachineDescription& machine) {
  if (!evidence.machine_pause || stop.machine_unheard) return std::nullopt;
  const auto [from, to] = *evidence.machine_pause;
  Cause cause{"machine_loop_paused",
              fmt::format("the machine's loop did not run from {} to {} ({}): its program was stopped or starved, or "
                          "its computer froze; check what else runs there and its real-time permission",
                          at_text(from), at_text(to), span_text(to - from)),
              {},
              {},
              from};
  cause.supports.push_back(
      fmt::format("no step of it is in the recording meanwhile, and its step numbers are without a "
                  "gap: none was lost on the way; limit {:.0f} ms",
                  1e3 * machine.bus.valve_watchdog_s));
  if (const std::string guard = own_guard_text(machine.bus); !guard.empty())
    cause.supports.push_back("no command frame was sent meanwhile: " + guard);
  if (evidence.from_operator.last && *evidence.from_operator.last > from)
    cause.supports.push_back("the operator's side went on sending meanwhile: link and operator's side are sound");
  return cause;
}

std::optional<Cause> controller_off(const Evidence& evidence) {
  if (!evidence.can_changed) return std::nullopt;
  const Time at = *evidence.can_changed;
  const std::string of_bus = evidence.of_bus();
  const std::string after =
      fmt::format("in the 200 ms from then on: {} frames received, {} sent, {} refused by the interface",
                  evidence.can_received_after, evidence.can_sent_after, evidence.can_refused_after);
  switch (evidence.can_states[evidence.can_bus]) {
    case CanState::kActive:
      return std::nullopt;
    case CanState::kDown:
      return Cause{"can_down",
                   "the CAN interface" + of_bus + " was taken down at " + at_text(at) +
                       ": by a command (ip link set NAME down) or because its adapter was pulled",
                   {"the interface reported \"down\" at " + at_text(at), after},
                   {"it was not the bus: a bus with errors leads to error-passive or bus-off, not to \"down\""},
                   at};
    case CanState::kBusOff:
      return Cause{"bus_off",
                   "the controller" + of_bus + " went bus-off at " + at_text(at) +
                       ": too many errors in its own frames; check for a short circuit, termination, bit rate",
                   {"the interface reported \"bus-off\" at " + at_text(at), after},
                   {},
                   at};
    case CanState::kPassive:
      break;
  }
  const bool nothing = evidence.can_received_after == 0, nodes = !evidence.nodes.empty() && evidence.can_bus == 0;
  if (nothing && !nodes) {
    return Cause{"bus_cut",
                 (evidence.bus.empty() ? "the bus" : evidence.bus) + " is cut, or what sends on it lost power: from " +
                     at_text(at) + " on no frame of it was heard",
                 {"the controller" + of_bus + " is error-passive since " + at_text(at), after},
                 {"a cut cable and lost power look the same from here"},
                 evidence.can_received.last.value_or(at)};
  }
  if (nothing) {
    return Cause{"bus_cut",
                 "the bus is cut between controller and nodes, or all nodes lost power: from " + at_text(at) +
                     " on nobody acknowledged the controller's frames, and no node was heard",
                 {"the controller" + of_bus + " is error-passive since " + at_text(at), after},
                 {"a cut cable and lost power of all nodes look the same from here"},
                 evidence.can_received.last.value_or(at)};
  }
  return Cause{
      "bus_disturbed",
      "frames on the bus are damaged or not acknowledged since " + at_text(at) +
          ": check termination, cable, bit rate, disturbances",
      {"the controller" + of_bus + " is error-passive since " + at_text(at), after},
      {std::string("no cut cable and no lost power: ") + (nodes ? "the nodes are" : "frames are") + " still heard"},
      at};
}

Cause by_operator(const Stop& stop, const char* id, const std::string& text) {
  return Cause{id, text, {}, {}, stop.at};
}

/// Who says whether E-stop and pilot pressure are as they should be: the enable node, or a frame of the machine.
std::string teller_text(const BusDescription& bus, int index) {
  const BroadcastFrame* const frame = bus.broadcast(NodeRole::kEnable, index).frame;
  return frame == nullptr ? node_text(bus.enable()) : frame_text(*frame, bus);
}

/// Of a machine that is led by frames and measures the pressures that move its spools.
std::optional<Cause> pilots(const Stop& stop, const MachineDescription& machine) {
  if (stop.reason.code != ReasonCode::kValveNotFollowing || !machine.bus.by_frames()) return std::nullopt;
  if (stop.reason.subject >= kJoints) return std::nullopt;
  return Cause{
      "pilot_not_following",
      std::string("the pilot pressures of the ") + kJointNames[stop.reason.subject] +
          " were not as the machine was told: a pilot valve that sticks, its line or its magnet's plug, or "
          "somebody's lever",
      {"by them its spool was where nobody had asked for it in the 100 ms before, or much longer where joints' "
       "speeds are told"},
      {"a pressure sensor that is wrong looks the same: did the cylinder move?"},
      stop.at};
}

std::optional<Cause> motion(const Stop& stop, const MachineDescription& machine) {
  if (stop.reason.code != ReasonCode::kMotionNotFollowing || stop.reason.subject >= kJoints) return std::nullopt;
  return Cause{"motion_not_following",
               std::string("the ") + kJointNames[stop.reason.subject] + " did not move as the machine was told",
               {"its angle or length went further than it was told, or stood while nothing held it"},
               {tells_pilots(machine.bus, stop.reason.subject)
                    ? "its pilot pressures were as told: a spool that sticks and a position sensor that is wrong look "
                      "the same from here"
                    : "nobody tells where its spool is: a valve that sticks, a position sensor that stands still and a "
                      "fault of the machine's own controller look the same from here"},
               stop.at};
}

std::optional<Cause> e_stop(const Stop& stop, const Evidence& evidence, const MachineDescription& machine) {
  if (stop.reason.code != ReasonCode::kEmergencyStop) return std::nullopt;
  const Time at = evidence.e_stop_opened.value_or(stop.at);
  Cause cause{"e_stop",
              "the E-stop chain of the machine was opened at " + at_text(at) +
                  ": somebody pressed an E-stop at the machine, or its wiring is open",
              {},
              {"a pressed button and a broken wire of the chain look the same from here"},
              at};
  cause.supports.push_back("the input \"E-stop chain closed\" of " + teller_text(machine.bus, kEStopClosedIndex) +
                           " went off" + (evidence.e_stop_opened ? " at " + at_text(at) : ""));
  const bool nodes = std::none_of(evidence.nodes.begin(), evidence.nodes.end(),
                                  [](const NodeSeen& seen) { return seen.silent() || !seen.emergencies.empty(); });
  const bool frames = std::none_of(evidence.frames.begin(), evidence.frames.end(),
                                   [](const FrameSeen& seen) { return seen.stream.silent(); });
  if (nodes && frames)
    cause.supports.emplace_back(evidence.nodes.empty()
                                    ? "all that the machine sends came in time: no fault of the bus"
                                    : "no node was silent or reported an emergency: no fault of the bus");
  return cause;
}

std::optional<Cause> asked_for(const Stop& stop, const Window& window, const Evidence& evidence,
                               const MachineDescription& machine) {
  switch (stop.reason.code) {
    case ReasonCode::kOperatorStop: {
      const bool by_device = std::any_of(window.hid.begin(), window.hid.end(), [&](const HidSeen& seen) {
        return seen.at <= stop.at && stop.at - seen.at <= 500ms && seen.state &&
               (seen.state->status & kDeviceStop) != 0;
      });
      Cause cause = by_operator(stop, "operator_stop", "the operator pressed Stop");
      cause.supports.emplace_back(by_device ? "the stop button of the haptic device was down in its reports"
                                            : "the operator's messages say so" +
                                                  std::string(window.operator_states.empty()
                                                                  ? ""
                                                                  : "; the device's own button was not down: it was "
                                                                    "the console's, or a program's"));
      return cause;
    }
    case ReasonCode::kPresenceLost:
      return by_operator(stop, "hand_left", "the hand left the device while enable was held");
    case ReasonCode::kPilotOff: {
      Cause cause = by_operator(stop, "pilot_lost", "pilot pressure went away although the enable output was on");
      cause.supports.push_back("the input \"pilot pressure on\" of " + teller_text(machine.bus, kPilotOnIndex) +
                               " went off" + (evidence.pilot_lost ? " at " + at_text(*evidence.pilot_lost) : ""));
      cause.against.emplace_back("the E-stop chain stayed closed");
      return cause;
    }
    default:
      return std::nullopt;
  }
}

}  // namespace

Cause likely_cause(const Stop& stop, const Window& window, const Evidence& evidence,
                   const MachineDescription& machine) {
  if (auto cause = loop_paused(stop, evidence, machine)) return *cause;
  if (auto cause = e_stop(stop, evidence, machine)) return *cause;
  if (auto cause = asked_for(stop, window, evidence, machine)) return *cause;
  if (auto cause = bus_cause(stop, window, machine)) return *cause;
  if (auto cause = j1939_cause(stop, window, machine)) return *cause;
  if (auto cause = controller_off(evidence)) return *cause;
  if (auto cause = device_cause(stop, window, evidence)) return *cause;
  if (auto cause = link_cause(stop, window, evidence)) return *cause;
  if (auto cause = pilots(stop, machine)) return *cause;
  if (auto cause = motion(stop, machine)) return *cause;
  if (auto cause = frame_cause(stop, evidence, machine)) return *cause;
  if (auto cause = node_cause(stop, window, evidence, machine)) return *cause;
  return Cause{"unclear",
               "as the loop says: " + reason_text(machine, stop.reason),
               {},
               {"nothing else on the wires is out of the ordinary"},
               stop.at};
}

}  // namespace knuckle::explain
