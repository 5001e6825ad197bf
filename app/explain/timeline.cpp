#include "app/explain/timeline.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/explain/last_inputs.h"
#include "app/explain/last_second.h"
#include "app/explain/text.h"
#include "core/error.h"
#include "machine/load.h"

namespace knuckle::explain {
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
  timeline.inputs = last_inputs(stop, window, evidence);
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
  return unusual(evidence_of(nothing, window, machine), window);
}

}  // namespace

Report report_on(recording::Recording& recording, Sides sides) {
  const MachineDescription machine = machine_of(recording);
  Report report;
  report.survey = find_stops(recording, sides);
  if (report.survey.machine_steps + report.survey.operator_steps == 0)
    throw InputError(recording.source() + ": holds no step of any loop: there is nothing to explain");
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
