#include "app/explain/explain_command.h"

#include <fmt/format.h>

#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "app/cli/interrupt.h"
#include "app/cli/json.h"
#include "app/cli/output_file.h"
#include "app/explain/timeline.h"
#include "app/explain/window.h"
#include "recording/recording.h"

namespace knuckle::explain {
namespace {

using cli::Json;

struct Options {
  std::vector<std::string> files;
  std::string json, side;
};

void print(std::ostream& out, const char* heading, const std::vector<std::string>& lines) {
  if (lines.empty()) return;
  out << heading << '\n';
  for (const std::string& line : lines) out << "  " << line << '\n';
}

void print(std::ostream& out, const Timeline& timeline) {
  out << timeline.headline << '\n';
  out << "Most likely: " << timeline.cause.text << '\n';
  for (const std::string& line : timeline.cause.supports) out << "  for: " << line << '\n';
  for (const std::string& line : timeline.cause.against) out << "  but: " << line << '\n';
  print(out, "Last inputs", timeline.inputs);
  print(out, "Last second", timeline.before);
  print(out, "Afterwards", timeline.after);
}

/// What a recording without a stop says of the machine.
std::string without_a_stop(const recording::Recording& recording) {
  if (recording.head().imported) return "An imported table has no modes: it says nothing of what stopped the machine.";
  if (!recording.damages().empty()) return "No stop in what could be read; what could not is missing.";
  if (!recording.complete()) return "No stop in what was recorded before its recording ended too early.";
  return "Nothing stopped the machine.";
}

void print(std::ostream& out, const Report& report, const recording::Recording& recording) {
  const Survey& survey = report.survey;
  out << fmt::format("From {} to {}: {} stop{}\n", at_text(survey.first), at_text(survey.last), survey.stops.size(),
                     survey.stops.size() == 1 ? "" : "s");
  if (!report.began_with.empty())
    out << "The machine was stopped already when it begins: " << report.began_with << '\n';
  if (survey.stops.empty()) {
    out << without_a_stop(recording) << '\n';
    print(out, "Out of the ordinary all the same", report.notes);
  }
  for (std::size_t i = 0; i < report.timelines.size(); ++i) {
    out << fmt::format("\n[{}] ", i + 1);
    print(out, report.timelines[i]);
  }
}

Json seconds(const std::optional<Time>& at) {
  return at ? Json(to_seconds(*at)) : Json(nullptr);
}

Json json_of(const Timeline& timeline) {
  const Reason& reason = timeline.stop.reason;
  const WhatFollowed& after = timeline.followed;
  return {{"at_s", to_seconds(timeline.stop.at)},
          {"mode_before", name(timeline.stop.before)},
          {"mode", name(timeline.stop.mode)},
          {"code", name(reason.code)},
          {"subject", reason.subject},
          {"value", reason.value},
          {"limit", reason.limit},
          {"headline", timeline.headline},
          {"cause",
           {{"id", timeline.cause.id},
            {"text", timeline.cause.text},
            {"since_s", to_seconds(timeline.cause.since)},
            {"supports", timeline.cause.supports},
            {"against", timeline.cause.against}}},
          {"last_inputs", timeline.inputs},
          {"last_second", timeline.before},
          {"afterwards", timeline.after},
          {"commands_neutral_s", seconds(after.commands_neutral)},
          {"spools_neutral_s", seconds(after.spools_neutral)},
          {"pilot_off_s", seconds(after.pilot_off)},
          {"enable_released_s", seconds(after.released)},
          {"enable_pressed_s", seconds(after.pressed)},
          {"home_on_two_s", seconds(after.home)},
          {"engaged_again_s", seconds(after.resumed)}};
}

Json json_of(const Report& report, const recording::Recording& recording) {
  Json json{{"schema", "knuckle-explain/1"},
            {"recording", recording.source()},
            {"version", recording.head().version},
            {"from_s", to_seconds(report.survey.first)},
            {"to_s", to_seconds(report.survey.last)},
            {"complete", defects(recording).empty()},
            {"damages", recording.damages()},
            {"stopped_at_begin", report.survey.begins_stopped},
            {"stops", Json::array()},
            {"notes", report.notes}};
  for (const Timeline& timeline : report.timelines) json["stops"].push_back(json_of(timeline));
  return json;
}

Sides sides_named(const std::string& side) {
  if (side != "" && side != "machine" && side != "operator")
    cli::refuse_option("--side", side, "must be machine or operator");
  return {.operator_side = side != "machine", .machine_side = side != "operator"};
}

int run(const Options& o) {
  cli::Places places;
  for (const std::string& file : o.files) places.input("FILE", file);
  places.output("--json", o.json);
  cli::OptionalOutput json("--json", o.json);  // refused before anything is told
  const cli::InterruptGuard interrupt;
  recording::Recording recording(o.files);
  const Report report = report_on(recording, sides_named(o.side));
  for (const std::string& remark : remarks(recording)) std::cerr << "knuckle explain: " << remark << '\n';
  if (!cli::is_standard_output(o.json)) print(std::cout, report, recording);
  json.write([&](std::ostream& to) { to << json_of(report, recording).dump(2) << '\n'; });
  return recording.damages().empty() ? 0 : 1;
}

}  // namespace

cli::Command explain_entry() {
  return cli::command<Options>(
      "explain", "Say in words what stopped the machine in a recording, how it came about, and the likely cause",
      [](const cli::OptionList& command, Options& o) {
        command
            .add_option("FILE", o.files, "Flight record or any recording (.mcap); of several parts all, in their order")
            .required();
        command.add_option("--side", o.side,
                           "Of a simulation's recording only what this side recorded, as on a real machine: "
                           "machine or operator");
        command.add_option("--json", o.json, "The same as JSON; - is standard output");
      },
      run);
}

}  // namespace knuckle::explain
