#include "app/explain/timeline.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "app/explain/window.h"
#include "core/error.h"
#include "machine/load.h"
#include "machine/pilot_spool.h"
#include "machine/reason_text.h"
#include "machine/set_points.h"

namespace knuckle::explain {
namespace {

constexpr double kSpoolMargin = 0.01;  // of stroke; dead bands are known to that

/// What the valves were last told, frame by frame.
class ValveCommands {
 public:
  explicit ValveCommands(const MachineDescription& machine) : bus_(machine.bus) {}
  /// @return whether it was one for a valve.
  bool take(const CanFrame& frame) {
    bool any = false;
    for (int joint = 0; joint < kJoints; ++joint) {
      const auto told = set_point_in(frame, joint, bus_);
      if (!told) continue;
      open_[static_cast<std::size_t>(joint)] = *told != 0;
      any = true;
    }
    return any;
  }
  [[nodiscard]] bool neutral() const {
    return std::none_of(open_.begin(), open_.end(), [](bool open) { return open; });
  }

 private:
  const BusDescription& bus_;
  std::array<bool, kJoints> open_{};
};

void note_commands(const Stop& stop, const Window& window, const MachineDescription& machine, WhatFollowed& after) {
  ValveCommands commands(machine);
  int sent = 0;
  Time since = window.from;
  bool neutral = true;
  const Time until = after.resumed.value_or(window.to);
  for (const CanSeen& can : window.can) {
    if (can.at >= until) break;
    if (can.kind != WireEventKind::kCanSent || !commands.take(can.frame)) continue;
    if (can.at >= stop.at) ++sent;
    if (commands.neutral() && !neutral) since = can.at;
    if (!commands.neutral() && neutral && can.at > stop.at) after.moved_unasked = true;
    neutral = commands.neutral();
    if (neutral && can.at >= stop.at && !after.commands_neutral) after.commands_neutral = since;
  }
  after.sent_nothing = sent == 0;
}

bool spools_neutral(const slave::SlaveState& state, const MachineDescription& machine) {
  for (int joint = 0; joint < kJoints; ++joint) {
    const double spool = state.spool[joint];
    const double band = machine.cylinders[static_cast<std::size_t>(joint)].valve.dead_band(spool > 0);
    if (std::abs(spool) > band + kSpoolMargin) return false;
  }
  return true;
}

/// Since when something had held that was seen at or after the stop.
class Since {
 public:
  void see(Time at, bool holds, Time stop, std::optional<Time>& result) {
    if (holds && !held_) since_ = at;
    held_ = holds;
    if (holds && at >= stop && !result) result = since_;
  }

 private:
  bool held_ = false;
  Time since_{};
};

std::string when(const char* what, const std::optional<Time>& at, const Stop& stop, Time known_until) {
  if (!at) return fmt::format("{}: not seen until {}, where what is known ends", what, at_text(known_until));
  if (*at < stop.at) return fmt::format("{}: already, since {}", what, at_text(*at));
  return fmt::format("{}: {:.0f} ms after the stop", what, 1e3 * to_seconds(*at - stop.at));
}

}  // namespace

WhatFollowed what_followed(const Stop& stop, const Window& window, const MachineDescription& machine) {
  WhatFollowed after;
  after.known_until = window.machine.empty() ? window.from : window.machine.back().at;
  Since pilot, spools;
  bool enable = false, home_before = false;
  const bool spools_told = !machine.bus.by_frames() || tells_pilots(machine.bus);
  for (const slave::SlaveState& state : window.machine) {
    if (state.at <= stop.at) home_before = state.home_on_two;
    pilot.see(state.at, !state.pilot_on, stop.at, after.pilot_off);
    if (spools_told) spools.see(state.at, spools_neutral(state, machine), stop.at, after.spools_neutral);
    if (state.at > stop.at && !after.resumed) {
      if (!state.enable && enable) after.released = state.at;
      if (state.enable && !enable) after.pressed = state.at;
      const bool by_operator =
          state.blocking.code == ReasonCode::kReleaseToRecover || state.blocking.code == ReasonCode::kEnableNotPressed;
      if (state.home_on_two && !home_before && !after.home) after.home = state.at;
      if (by_operator && !after.cause_gone && !after.home) after.cause_gone = state.at;
      if (state.mode == Mode::kEngaged) after.resumed = state.at;
    }
    enable = state.enable;
  }
  note_commands(stop, window, machine, after);
  after.spools_told = spools_told;
  after.guard = own_guard_text(machine.bus);
  if (after.guard.empty())
    after.guard = "their own watchdogs centre the spools, and the enable node removes pilot pressure";
  return after;
}

std::vector<std::string> lines_of(const WhatFollowed& after, const Stop& stop) {
  std::vector<std::string> lines;
  if (after.sent_nothing)
    lines.push_back("valves: no command got onto the wire any more: " + after.guard);
  else
    lines.push_back(when("valve commands neutral on the wire", after.commands_neutral, stop, after.known_until));
  if (after.spools_told)
    lines.push_back(when("spools in their dead bands, first reported", after.spools_neutral, stop, after.known_until));
  lines.push_back(when("pilot pressure off, first reported", after.pilot_off, stop, after.known_until));
  if (after.moved_unasked) lines.emplace_back("A VALVE WAS COMMANDED AGAIN before the machine was engaged");
  std::string how =
      !after.resumed ? fmt::format("not engaged again until {}, where what is known ends", at_text(after.known_until))
                     : "engaged again at " + at_text(*after.resumed);
  if (after.home)
    how += "; the operator chose at " + at_text(*after.home) + " to go home without that cylinder's pressures";
  if (after.cause_gone) how += "; what was noticed had passed at " + at_text(*after.cause_gone);
  if (after.released) how += "; enable was released at " + at_text(*after.released);
  if (after.pressed) how += ", pressed at " + at_text(*after.pressed);
  lines.push_back(how);
  return lines;
}

namespace {

constexpr Duration kBefore = 12s,
                   kAfter = 15s;       // what is usual is learned from the former; the latter is to recover in
constexpr Duration kNoteLength = 60s;  // of a recording without stops, at its end

MachineDescription machine_of(const recording::Recording& recording) {
  const std::string& text = recording.head().machine_file;
  if (text.empty())
    throw InputError(recording.source() + ": attachment " + recording::kMachineFile +
                     ": is missing: nodes and axes cannot be named");
  return calibrated(parse_machine(text, recording.source() + ": " + recording::kMachineFile));
}

std::string headline_of(const Stop& stop, const MachineDescription& machine) {
  std::string mode = name(stop.before);
  std::replace(mode.begin(), mode.end(), '_', ' ');
  return fmt::format("stopped at {}, while {}; noticed first: {}", at_text(stop.at), mode,
                     reason_text(machine, stop.reason));
}

Timeline timeline_of(const Stop& stop, const Window& window, const MachineDescription& machine) {
  const Evidence evidence = evidence_of(stop, window, machine);
  Timeline timeline;
  timeline.stop = stop;
  timeline.headline = headline_of(stop, machine);
  timeline.cause = likely_cause(stop, window, evidence, machine);
  timeline.inputs = last_inputs(stop, window, evidence, machine.bus);
  timeline.before = last_second(stop, window, machine);
  if (!window.machine.empty()) {
    timeline.followed = what_followed(stop, window, machine);
    timeline.after = lines_of(timeline.followed, stop);
  } else {
    timeline.after.emplace_back("the machine's side is not in this recording");
  }
  return timeline;
}

/// Nodes that nobody knows, and process data that came late.
std::vector<std::string> notes_on(recording::Recording& recording, Sides sides, const Survey& survey,
                                  const MachineDescription& machine) {
  const Window window = load_window(recording, sides, std::max(survey.first, survey.last - kNoteLength), survey.last);
  Stop nothing;
  nothing.at = survey.last;
  std::vector<std::string> notes = unusual(evidence_of(nothing, window, machine), window);
  const std::vector<std::string> of_j1939 = j1939_notes(window, machine);
  notes.insert(notes.end(), of_j1939.begin(), of_j1939.end());
  return notes;
}

}  // namespace

Report report_on(recording::Recording& recording, Sides sides) {
  const MachineDescription machine = machine_of(recording);
  Report report;
  report.survey = find_stops(recording, sides, machine.bus);
  if (report.survey.machine_steps + report.survey.operator_steps == 0)
    throw InputError(recording.source() + ": holds no step of any loop: there is nothing to explain");
  if (report.survey.begins_stopped) report.began_with = reason_text(machine, report.survey.began_with);
  const std::vector<Stop>& stops = report.survey.stops;
  for (std::size_t i = 0; i < stops.size(); ++i) {
    Time to = stops[i].at + kAfter;
    if (i + 1 < stops.size()) to = std::min(to, stops[i + 1].at - 1ms);
    report.timelines.push_back(
        timeline_of(stops[i], load_window(recording, sides, stops[i].at - kBefore, to), machine));
  }
  if (stops.empty()) report.notes = notes_on(recording, sides, report.survey, machine);
  return report;
}

}  // namespace knuckle::explain
