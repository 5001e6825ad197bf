#include "app/report/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "app/report/metric_text.h"
#include "app/report/number_text.h"
#include "app/report/verdict_text.h"
#include "app/session/limit_times.h"

namespace knuckle::report {
namespace {

using session::CriterionKind;
using session::CriterionResult;

std::string what_ran(const session::SessionResult& s) {
  const double speed = s.wall_s > 0 ? s.simulated_s / s.wall_s : 0.0;
  return fmt::format("{} on {}, seed {}: {:.1f} s simulated in {:.2f} s ({:.{}f} x real time)\n", s.scenario,
                     s.machine_name, s.seed, s.simulated_s, s.wall_s, speed, speed < 10 ? 1 : 0);
}

std::string line_of(const CriterionResult& result, const session::Metrics& metrics) {
  const std::string excuse = excuse_text(result, metrics), moment = moment_text(result);
  return fmt::format("    {}: {}{}{} [{}]\n", metric_text(result.name), value_text(result),
                     excuse.empty() ? "" : "; " + excuse, moment.empty() ? "" : "; at " + moment, result.name);
}

std::string block(const std::string& title, const std::vector<const CriterionResult*>& results,
                  const session::Metrics& metrics) {
  if (results.empty()) return "";
  std::string text = "  " + title + "\n";
  for (const CriterionResult* result : results) text += line_of(*result, metrics);
  return text;
}

/// A wall that held is seldom meant, so it is always told; other limits are part of every session.
std::string limits_line(const session::SessionResult& session, bool all) {
  constexpr double kWorthTelling_s = 0.1;
  std::string list;
  for (const session::LimitTime& one : session::limit_times(session.record, session.machine.limits)) {
    if (one.time_s >= kWorthTelling_s && (one.wall || all))
      list += fmt::format("{}{} for {:.1f} s", list.empty() ? "" : ", ", one.limit, one.time_s);
  }
  return list.empty() ? "" : "  held back by limits: " + list + "\n";
}

}  // namespace

std::string shown(const std::optional<double>& value, const std::string& unit) {
  if (!value) return "-";
  return number_text(*value) + (unit == "1" ? "" : " " + unit);
}

std::string summary_text(const session::Judged& judged, const std::string& report, bool verbose) {
  const session::SessionResult& s = judged.session;
  const Sorted by = sorted(judged);
  std::string text = what_ran(s) + "  " + done_text(judged) + "\n";
  for (const std::string& note : s.notes) text += "  note: " + note + "\n";
  for (const session::FaultRecord& f : s.record.faults)
    text += fmt::format("  fault at {:.2f} s: ", f.at_s) + knuckle::text(f.reason) + "\n";
  for (const session::WarningRecord& w : s.record.warnings)
    text += fmt::format("  warning at {:.2f} s: ", w.at_s) + knuckle::text(w.reason) + "\n";
  text += limits_line(s, verbose);
  text += block("FAILED:", by.failed, judged.metrics);
  text +=
      block("requirements not met; they decide with the default machine and seeds 1 to 20, or with --judge:", by.shown,
            judged.metrics);
  text += block(goals_text(judged) + ":", by.towards, judged.metrics);
  if (verbose) text += block("met:", by.met, judged.metrics) + block("not judged:", by.open, judged.metrics);
  text += verdict_text(judged) + "\n";
  if (!s.log.file.empty() && s.log.problem.empty()) text += "recording: " + s.log.file + "\n";
  if (!report.empty()) text += "report: " + report + "\n";
  return text;
}

}  // namespace knuckle::report
