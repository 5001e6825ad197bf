#include "app/programs/program_frame.h"

namespace knuckle::programs {

void RunOptions::add(const cli::OptionList& command, const char* csv_about, const char* json_about) {
  command.add_option("--duration", duration_s, "Stop after so many seconds (default: when interrupted)");
  command.add_option("--csv", csv, csv_about);
  command.add_option("--json", json, json_about);
}

void RunOptions::check() const {
  cli::check_range("--duration", duration_s, 0.1, kLongestRun_s, " s");
}

void RunOptions::take(cli::Places& places) const {
  places.output("--csv", csv);
  places.output("--json", json);
}

ProgramFrame::ProgramFrame(const std::string& program, const RunOptions& options, const cli::InterruptGuard& interrupt)
    : console(program),
      csv("--csv", options.csv),
      json("--json", options.json, AskedOutput::Content::kResult),
      run{[&interrupt] { return !interrupt.pending(); }, console} {
  run.duration_s = options.duration_s.value_or(run.duration_s);
  run.outputs = {&csv};
}

const ProgramRun& ProgramFrame::start() {
  started_ = std::chrono::steady_clock::now();
  started_unix_s_ = unix_time_s();
  return run;
}

void ProgramFrame::finish(const char* schema, const cli::Json& own, double ran_s, std::uint64_t records_lost) {
  records_lost += finish_records(console, run.outputs);
  cli::Json result{
      {"schema", schema}, {"version", cli::program_version()}, {"started_unix_s", started_unix_s_}, {"ran_s", ran_s}};
  result.update(own);
  result["records_lost"] = records_lost;
  result["lines_lost"] = console.lines_lost();
  if (auto* out = json.stream()) *out << result.dump(2) << '\n';
  std::vector<AskedOutput*> outputs = run.outputs;
  outputs.push_back(&json);
  commit_all(outputs);
}

}  // namespace knuckle::programs
