#include "app/report/summary.h"

#include <fmt/format.h>

#include "app/report/number_text.h"

namespace knuckle::report {
namespace {

std::string what_ran(const session::SessionResult& s) {
  const double speed = s.wall_s > 0 ? s.simulated_s / s.wall_s : 0.0;
  return fmt::format("{} on {}, seed {}: {:.1f} s simulated in {:.2f} s ({:.{}f} x real time)\n", s.scenario,
                     s.machine_name, s.seed, s.simulated_s, s.wall_s, speed, speed < 10 ? 1 : 0);
}

std::string key_numbers(const session::Metrics& m) {
  return "  tip error in free motion " + shown(m.tip_rms_m, "m") + " RMS, force error without load " +
         shown(m.no_load_rms_N, "N") + ", hold error " + shown(m.hold_error_N, "N") + "\n";
}

}  // namespace

std::string shown(const session::Metric& value, const std::string& unit) {
  if (!value) return "-";
  return number_text(*value) + (unit == "1" ? "" : " " + unit);
}

std::string summary_text(const session::Judged& judged, const std::string& report) {
  const session::SessionResult& s = judged.session;
  std::string text = what_ran(s);
  text += key_numbers(judged.metrics);
  for (const std::string& note : s.notes) text += "  note: " + note + "\n";
  for (const session::FaultRecord& f : s.record.faults)
    text += fmt::format("  fault at {:.2f} s: ", f.at_s) + knuckle::text(f.reason) + "\n";
  for (const session::WarningRecord& w : s.record.warnings)
    text += fmt::format("  warning at {:.2f} s: ", w.at_s) + knuckle::text(w.reason) + "\n";
  for (const session::CriterionResult& c : judged.criteria)
    text += fmt::format("  {}  {:22} {:>12}  {} {}\n", c.passed ? "pass" : "FAIL", c.name, shown(c.value, c.unit),
                        c.relation == "max" ? "<=" : ">=", shown(c.bound, c.unit));
  text += judged.criteria.empty() ? "  no criteria\n" : judged.passed ? "passed\n" : "NOT passed\n";
  if (!s.log.file.empty() && s.log.problem.empty()) text += "recording: " + s.log.file + "\n";
  if (!report.empty()) text += "report: " + report + "\n";
  return text;
}

}  // namespace knuckle::report
