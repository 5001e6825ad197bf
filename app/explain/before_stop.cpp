// What each wire said last, and what operator, sensors and estimate said in the last second.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <utility>

#include "app/explain/timeline.h"
#include "app/explain/window.h"
#include "core/units.h"
#include "estimation/force_estimator.h"
#include "machine/reason_text.h"

namespace knuckle::explain {
namespace {

constexpr std::size_t kMostNodes = 3, kMostFirsts = 4;

std::string age_text(const Stream& stream, const Stop& stop) {
  if (!stream.last) return "never";
  return fmt::format("{} old (usual every {})", span_text(stop.at - *stream.last), span_text(stream.usual));
}

std::string again_text(const Stream& stream) {
  return stream.next ? "again at " + at_text(*stream.next)
                     : "not again by " + at_text(stream.known_until) + ", where this view ends";
}

std::string node_line(const NodeSeen& seen, const Stop& stop) {
  std::string line =
      fmt::format("  {} (0x{:02X}): process data {}", seen.node.name, seen.node.id, age_text(seen.data, stop));
  if (seen.data.silent()) line += ", " + again_text(seen.data);
  line += "; heartbeat " + age_text(seen.heartbeat, stop);
  if (seen.heartbeat.silent()) line += ", " + again_text(seen.heartbeat);
  return line;
}

/// Of two buses each by its name, the worse one first.
std::string controllers_text(const Evidence& evidence, const BusDescription& bus) {
  const std::string since = evidence.can_changed ? " since " + at_text(*evidence.can_changed) : "";
  const std::size_t worse = evidence.can_bus;
  if (!bus.second) return fmt::format("controller {}{}", name(evidence.can_states[worse]), since);
  const std::string of_worse =
      fmt::format("controller of bus {} {}{}", bus.line(worse).name, name(evidence.can_states[worse]), since);
  const std::size_t other = 1 - worse;
  return evidence.both_told ? of_worse + ", of bus " + bus.line(other).name + " " + name(evidence.can_states[other])
                            : of_worse;
}

void add_can(const Stop& stop, const Evidence& evidence, const BusDescription& bus, std::vector<std::string>& lines) {
  const auto odd = [](const NodeSeen& seen) { return seen.data.silent() || seen.heartbeat.silent(); };
  const auto missing = [](const FrameSeen& seen) { return seen.stream.silent(); };
  std::string in_time;
  const auto count = [&in_time](const auto& all, const auto& late, const char* what) {
    const auto sound = std::count_if(all.begin(), all.end(), [&](const auto& seen) { return !late(seen); });
    if (!all.empty()) in_time += fmt::format("{} of {} {}; ", sound, all.size(), what);
  };
  count(evidence.nodes, odd, "nodes sent in time");
  count(evidence.frames, missing, "frames of the machine came in time");
  lines.push_back(fmt::format("CAN: {}{}; newest frame of any {}", in_time, controllers_text(evidence, bus),
                              age_text(evidence.can_received, stop)));
  if (evidence.machine_pause)
    lines.push_back(
        std::string("  as far as the machine's loop has read") +
        (evidence.nodes.empty() ? "" : "; it also sends SYNC, so a silence of nodes follows from its pause"));
  std::size_t shown = evidence.machine_pause ? kMostNodes : 0;
  for (const NodeSeen& seen : evidence.nodes)
    if (odd(seen) && shown++ < kMostNodes) lines.push_back(node_line(seen, stop));
  for (const FrameSeen& seen : evidence.frames)
    if (missing(seen) && shown++ < kMostNodes)
      lines.push_back(fmt::format("  {}: {}, {}", seen.name, age_text(seen.stream, stop), again_text(seen.stream)));
  if (shown > kMostNodes && !evidence.machine_pause)
    lines.push_back(fmt::format("  and {} more likewise", shown - kMostNodes));
  for (const NodeSeen& seen : evidence.nodes) {
    if (seen.emergencies.empty()) continue;
    const EmergencySeen& first = seen.emergencies.front();
    lines.push_back(
        fmt::format("  {} (0x{:02X}): emergency 0x{:04X} ({}) at {}{}", seen.node.name, seen.node.id,
                    first.emergency.code, canopen::emergency_text(first.emergency.code), at_text(first.at),
                    seen.emergencies.size() > 1 ? fmt::format(", {} of them", seen.emergencies.size()) : ""));
  }
}

void add_link(const Stop& stop, const Window& window, const Evidence& evidence, std::vector<std::string>& lines) {
  if (!window.machine_steps.empty()) {
    std::string line = "link, at the machine: operator's newest message " + age_text(evidence.to_machine, stop);
    if (evidence.to_machine.silent()) line += ", " + again_text(evidence.to_machine);
    if (evidence.not_understood > 0) line += fmt::format(", {} unusable since", evidence.not_understood);
    const auto state = std::find_if(window.machine.rbegin(), window.machine.rend(),
                                    [&](const slave::SlaveState& s) { return s.at <= stop.at; });
    if (state != window.machine.rend() && state->heard)
      line += fmt::format("; round trip {:.1f} ms, late by {:.1f} ms", 1e3 * state->round_trip_s, 1e3 * state->late_s);
    lines.push_back(line + "; own newest datagram " + age_text(evidence.from_machine, stop));
  }
  if (!window.operator_steps.empty()) {
    std::string line = "link, at the operator: machine's newest message " + age_text(evidence.to_operator, stop);
    if (evidence.to_operator.silent()) line += ", " + again_text(evidence.to_operator);
    lines.push_back(line + "; own newest datagram " + age_text(evidence.from_operator, stop));
  }
}

void add_device(const Stop& stop, const Window& window, const Evidence& evidence, std::vector<std::string>& lines) {
  if (window.operator_steps.empty()) return;
  std::string line = fmt::format("haptic device: newest sound report {}", age_text(evidence.reports, stop));
  if (evidence.damaged_reports > 0) line += fmt::format(", {} damaged since", evidence.damaged_reports);
  if (evidence.reports.silent()) line += ", " + again_text(evidence.reports);
  if (evidence.unplugged) line += "; disconnected at " + at_text(*evidence.unplugged);
  lines.push_back(line);
}

void add_first(const Stop& stop, const Evidence& evidence, std::vector<std::string>& lines) {
  std::vector<std::pair<Time, std::string>> signs;
  const auto add = [&](const std::optional<Time>& at, const std::string& what) {
    if (at && *at <= stop.at) signs.emplace_back(*at, what);
  };
  for (const NodeSeen& seen : evidence.nodes) {
    // When it was due: until then nothing was wrong.
    if (seen.data.silent() && !evidence.machine_pause)
      add(*seen.data.last + seen.data.usual, seen.node.name + " missed its turn");
    add(seen.booted, seen.node.name + " started anew");
    if (!seen.emergencies.empty()) add(seen.emergencies.front().at, seen.node.name + " reported an emergency");
  }
  for (const FrameSeen& seen : evidence.frames)
    if (seen.stream.silent() && !evidence.machine_pause)
      add(*seen.stream.last + seen.stream.usual, seen.name + " missed its turn");
  for (std::size_t joint = 0; joint < kJoints; ++joint)
    add(evidence.valves[joint].apart_since, std::string(kJointNames[joint]) + " spool left its command");
  add(evidence.can_changed, "CAN controller" + evidence.of_bus() + " " + name(evidence.can_states[evidence.can_bus]));
  add(evidence.e_stop_opened, "E-stop chain open");
  add(evidence.pilot_lost, "pilot pressure off");
  add(evidence.unplugged, "device disconnected");
  if (evidence.to_machine.silent() || evidence.not_understood > 0)
    add(evidence.to_machine.last, "last usable message of the operator");
  if (evidence.reports.silent() || evidence.damaged_reports > 0) add(evidence.reports.last, "last sound device report");
  if (evidence.machine_pause) add(evidence.machine_pause->from, "last step of the machine's loop before its pause");
  if (evidence.operator_pause) add(evidence.operator_pause->from, "last step of the operator's loop before its pause");
  if (signs.empty()) return;
  std::stable_sort(signs.begin(), signs.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::string line = "changed first:";
  for (std::size_t i = 0; i < std::min(signs.size(), kMostFirsts); ++i)
    line += fmt::format("{} {} at {}", i == 0 ? "" : ";", signs[i].second, at_text(signs[i].first));
  if (signs.size() > kMostFirsts) line += fmt::format("; and {} more", signs.size() - kMostFirsts);
  lines.push_back(line);
}

}  // namespace

std::vector<std::string> last_inputs(const Stop& stop, const Window& window, const Evidence& evidence,
                                     const BusDescription& bus) {
  std::vector<std::string> lines;
  if (!window.machine_steps.empty()) add_can(stop, evidence, bus, lines);
  add_link(stop, window, evidence, lines);
  add_device(stop, window, evidence, lines);
  add_first(stop, evidence, lines);
  return lines;
}

std::vector<std::string> unusual(const Evidence& evidence, const Window& window) {
  std::vector<std::string> lines;
  for (const auto& [id, count] : evidence.foreign) {
    Time first = kNever, last = kNever;
    for (const CanSeen& can : window.can) {
      if (can.kind != WireEventKind::kCanReceived || can.frame.id != id) continue;
      if (first == kNever) first = can.at;
      last = can.at;
    }
    const double rate = count / std::max(1e-3, to_seconds(last - first));
    lines.push_back(fmt::format(
        "{} frames with identifier {}, which nothing in the machine file sends, from {} to "
        "{}: {:.0f} a second{}",
        count, id_text(id), at_text(first), at_text(last), rate, rate > 500 ? ": a node floods the bus" : ""));
  }
  return lines;
}

namespace {

constexpr Duration kSpan = 1s;
using slave::SlaveState;

/// Lowest and highest value of the last second.
struct Seen {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

/// Of the last second that is known until the stop.
template <typename State>
std::vector<const State*> last_of(const std::vector<State>& states, const Stop& stop) {
  std::vector<const State*> last;
  for (auto at = states.rbegin(); at != states.rend(); ++at) {
    if (at->at > stop.at) continue;
    if (!last.empty() && last.front()->at - at->at > kSpan) break;
    last.push_back(&*at);
  }
  std::reverse(last.begin(), last.end());
  return last;
}

/// "enable held" or "enable not held since 12.340 s".
template <typename State>
std::string switch_text(const char* name, const std::vector<const State*>& states, bool State::*is) {
  const bool now = states.back()->*is;
  std::string text = std::string(name) + (now ? " on" : " off");
  for (auto at = states.rbegin(); at != states.rend(); ++at)
    if ((*at)->*is != now) return text + " since " + at_text((*(at - 1))->at);
  return text;
}

template <typename State>
std::string operator_text(const std::vector<const State*>& states) {
  std::string text = switch_text("enable", states, &State::enable) + ", " +
                     switch_text("hand on the device", states, &State::presence) + ", " +
                     switch_text("clutch", states, &State::clutch) + ", " + switch_text("stop", states, &State::stop);
  const Reason& device = states.back()->device;
  return text + (states.back()->device_ok ? "; device ready" : "; device: " + knuckle::text(device));
}

std::string axis_text(const std::vector<const SlaveState*>& states, int joint) {
  const auto axis = static_cast<std::size_t>(joint);
  Seen length, a, b, told, spool;
  for (const SlaveState* state : states) {
    length.add(state->cylinder_m[joint]);
    a.add(state->pressure_Pa[2 * axis] / kBar);
    b.add(state->pressure_Pa[2 * axis + 1] / kBar);
    told.add(100 * state->valve_command[joint]);
    spool.add(100 * state->spool[joint]);
  }
  return fmt::format(
      "{:<6} cylinder {:.3f} to {:.3f} m, head {:.0f} to {:.0f} bar, rod {:.0f} to {:.0f} bar, valve told "
      "{:.0f} to {:.0f} %, spool {:.0f} to {:.0f} %",
      kJointNames[axis], length.low, length.high, a.low, a.high, b.low, b.high, told.low, told.high, spool.low,
      spool.high);
}

std::string estimate_text(const std::vector<const SlaveState*>& states) {
  Seen force, confidence;
  std::uint16_t doubts = 0;
  for (const SlaveState* state : states) {
    force.add(state->tip_force_N.norm());
    confidence.add(state->confidence);
    doubts |= state->confidence_reasons;
  }
  const std::string why = estimation::doubt_text(doubts);
  return fmt::format("estimate: tip force {:.0f} to {:.0f} N, confidence {:.2f} to {:.2f}{}; {}", force.low, force.high,
                     confidence.low, confidence.high, why.empty() ? "" : " (" + why + ")",
                     switch_text("contact", states, &SlaveState::contact));
}

/// Limits that were hit, since when, and whether still at the stop.
std::string limits_text(const std::vector<const SlaveState*>& states) {
  std::string text;
  for (unsigned bit = 0; limit_word(bit) != nullptr; ++bit) {
    std::optional<Time> first;
    int hit = 0;
    for (const SlaveState* state : states) {
      if ((state->limits >> bit & 1U) == 0) continue;
      if (!first) first = state->at;
      ++hit;
    }
    if (!first) continue;
    text += fmt::format("{}{} ({:.0f} % of the time, first at {})", text.empty() ? "" : ", ", limit_word(bit),
                        100.0 * hit / static_cast<double>(states.size()), at_text(*first));
  }
  return "limits hit: " + (text.empty() ? std::string("none") : text);
}

std::string gate_text(const std::vector<const SlaveState*>& states, const MachineDescription& machine) {
  double most_held = 0, least_authority = 1, highest_N = 0;
  for (const SlaveState* state : states) {
    most_held = std::max(most_held, (state->wanted - state->valve_command).cwiseAbs().maxCoeff());
    least_authority = std::min(least_authority, state->authority);
    highest_N = std::max(highest_N, state->tip_force_N.norm());
  }
  const SlaveState& last = *states.back();
  std::string text = fmt::format(
      "gate: changed the wanted commands by up to {:.0f} % of stroke; force ceiling {:.0f} N{}; "
      "assist {}",
      100 * most_held, machine.limits.tip_force_N,
      highest_N > machine.limits.tip_force_N ? ", exceeded" : ", not reached",
      last.assist_force_limit_N > 0 ? fmt::format("{:.0f} N", last.assist_force_limit_N) : std::string("off"));
  return text +
         fmt::format("; loss policy: authority {:.2f} at the stop, lowest {:.2f}", last.authority, least_authority);
}

}  // namespace

std::vector<std::string> last_second(const Stop& stop, const Window& window, const MachineDescription& machine) {
  std::vector<std::string> lines;
  const auto ours = last_of(window.operator_states, stop);
  const auto states = last_of(window.machine, stop);
  if (!ours.empty()) lines.push_back("operator, at the device: " + operator_text(ours));
  if (states.empty()) return lines;
  lines.push_back("operator, as the machine heard it: " + operator_text(states));
  for (int joint = 0; joint < kJoints; ++joint) lines.push_back(axis_text(states, joint));
  lines.push_back(estimate_text(states));
  lines.push_back(limits_text(states));
  lines.push_back(gate_text(states, machine));
  if (states.back()->blocking && !same_cause(states.back()->blocking, stop.reason))
    lines.push_back("in the way of moving on: " + reason_text(machine, states.back()->blocking));
  return lines;
}

}  // namespace knuckle::explain
