#include "app/simulate.h"

#include <iostream>
#include <nlohmann/json.hpp>

#include "app/csv_table.h"
#include "app/interrupt.h"
#include "app/output_file.h"
#include "app/progress.h"
#include "app/report.h"
#include "app/result_json.h"
#include "app/summary.h"

namespace knuckle::app {
namespace {

/// Every output asked for, opened before the session so that a bad place is known at once.
struct Outputs {
  explicit Outputs(const SimulateOptions& o) {
    open(candump, "--candump", o.candump);
    open(csv, "--csv", o.csv);
    open(report, "--report", o.report);
    open(json, "--json", o.json);
    if (report) check_report_tools();
  }
  std::optional<OutputFile> candump, csv, report, json;

 private:
  static void open(std::optional<OutputFile>& file, const char* option, const std::string& target) {
    if (!target.empty()) file.emplace(option, target);
  }
};

void commit(std::optional<OutputFile>& file) {
  if (file) file->commit();
}

bool uses_standard_output(const SimulateOptions& o) {
  return o.candump == "-" || o.csv == "-" || o.report == "-" || o.json == "-";
}

}  // namespace

Judged judge(const SessionResult& session) {
  Judged judged{session, compute_metrics(session.record), {}, false};
  judged.criteria = evaluate(session.criteria, judged.metrics);
  // Nobody can vouch for a session whose record has holes, whatever its scenario asks.
  if (session.record.records_lost > 0) {
    const auto holes = evaluate({{"records_lost", {}, 0}}, judged.metrics);
    judged.criteria.insert(judged.criteria.end(), holes.begin(), holes.end());
  }
  judged.passed = all_passed(judged.criteria);
  return judged;
}

int simulate_command(const SimulateOptions& options,
                     const std::function<SessionResult(const SimulateOptions&, const SessionHooks&)>& run) {
  const InterruptGuard interrupt;
  Outputs outputs(options);
  SessionResult session;
  {
    ProgressBar bar(options.scenario);
    SessionHooks hooks;
    hooks.progress = [&](double done_fraction) {
      interrupt.check();
      bar.show(done_fraction);
    };
    if (outputs.candump) hooks.candump = &outputs.candump->stream();
    session = run(options, hooks);
  }
  const Judged judged = judge(session);
  if (outputs.csv) write_csv(session.record, outputs.csv->stream());
  if (outputs.json) outputs.json->stream() << result_json(judged).dump(2) << '\n';
  for (auto* file : {&outputs.candump, &outputs.csv, &outputs.json}) commit(*file);
  // Last: should the plots fail, the numbers are safe.
  if (outputs.report) write_report(judged, outputs.report->stream());
  commit(outputs.report);
  // Standard output belongs to whatever was sent there.
  (uses_standard_output(options) ? std::cerr : std::cout) << summary_text(judged, options.report);
  return judged.passed ? 0 : 1;
}

}  // namespace knuckle::app
