#include <iostream>

#include "app/cli/output_file.h"
#include "app/cli/terminal.h"
#include "app/operators/study.h"

namespace knuckle::operators {
namespace {

struct Options {
  std::string plan, json, csv;
  std::string by = "condition";
};

Factor factor_of(const std::string& by) {
  if (by == "condition") return &PlannedRecording::condition;
  if (by == "input") return &PlannedRecording::input;
  cli::refuse_option("--by", by, "must be condition or input");
}

std::vector<MeasuredRecording> measured(std::vector<PlannedRecording> plan) {
  const cli::InterruptGuard interrupt;
  return cli::watched(interrupt, "recordings", [&](const auto& progress) {
    std::vector<MeasuredRecording> recordings;
    for (PlannedRecording& planned : plan) {
      const TaskRecording task = read_task(planned.file);
      for (const auto* lines : {&task.flaws, &task.notes})
        for (const std::string& line : *lines) std::cerr << "knuckle-studies operators: " << line << '\n';
      recordings.push_back({std::move(planned), measure(task), task.flaws});
      progress(static_cast<double>(recordings.size()) / static_cast<double>(plan.size()));
    }
    return recordings;
  });
}

int run(const Options& options) {
  const Factor factor = factor_of(options.by);
  std::vector<PlannedRecording> plan = load_plan(options.plan);
  cli::Places places;
  places.input("--plan", options.plan);
  for (const PlannedRecording& planned : plan) places.input("--plan", planned.file);
  places.output("--json", options.json);
  places.output("--csv", options.csv);
  cli::OptionalOutput json("--json", options.json), csv("--csv", options.csv);
  const std::vector<MeasuredRecording> recordings = measured(std::move(plan));
  const std::vector<StudyRow> rows = study_rows(recordings, factor);
  json.write([&](std::ostream& to) { write_json(recordings, rows, options.by, to); });
  csv.write([&](std::ostream& to) { write_csv(recordings, to); });
  if (cli::is_standard_output(options.json) || cli::is_standard_output(options.csv)) return 0;
  print_rows(rows, std::cout);
  print_left_out(recordings, std::cout);
  return 0;
}

}  // namespace

cli::Command operators_entry() {
  return cli::command<Options>(
      "operators", "Metrics of persons' tasks from recordings, and what differs between conditions",
      [](const cli::OptionList& command, Options& o) {
        command.add_option("--plan", o.plan, "Which recordings, of whom (.toml; docs/studies.md)").required();
        command.add_option("--by", o.by, "What is compared: condition or input").show_default();
        command.add_option("--json", o.json, "Write recordings and table as JSON");
        command.add_option("--csv", o.csv, "Write a CSV table, a row each recording");
      },
      run);
}

}  // namespace knuckle::operators
