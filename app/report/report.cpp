#include "app/report/report.h"

#include <fmt/format.h>

#include "app/report/filmstrip.h"
#include "app/report/html.h"
#include "app/report/metric_words.h"
#include "app/report/report_plots.h"
#include "app/report/summary.h"

namespace knuckle::report {
namespace {

void write_fact(std::ostream& out, const std::string& what, const std::string& value) {
  out << "<div><dt>" << what << "</dt><dd>" << escaped(value) << "</dd></div>\n";
}

void write_origin(std::ostream& out, const Origin& origin) {
  if (!origin.command_line.empty())
    out << "<p class=\"soft\"><code>" << escaped(origin.command_line) << "</code></p>\n";
  if (!origin.date_utc.empty()) out << "<p class=\"soft\">Written " << escaped(origin.date_utc) << "</p>\n";
}

void write_header(std::ostream& out, const session::Judged& judged, const Origin& origin) {
  const session::SessionResult& s = judged.session;
  const session::Metrics& m = judged.metrics;
  std::size_t met = 0;
  for (const session::CriterionResult& c : judged.criteria) met += c.passed ? 1 : 0;
  out << "<h1>" << escaped(s.scenario) << "</h1><p class=\"soft\">" << escaped(s.machine_name) << ", seed " << s.seed
      << ", " << escaped(s.operator_name) << " operator, " << escaped(s.control) << " law; link "
      << shown(s.delay_ms, "ms") << " one way, jitter " << shown(s.jitter_ms, "ms") << ", loss "
      << shown(100 * s.loss, "%") << (s.impairment.empty() ? "" : ", and more: " + escaped(s.impairment)) << "</p>\n";
  write_origin(out, origin);
  out << "<span class=\"verdict" << (judged.passed ? "" : " bad") << "\">" << (judged.passed ? "Passed" : "Not passed")
      << ": " << met << " of " << judged.criteria.size() << " criteria</span>\n<dl class=\"facts\">";
  write_fact(out, "tip error in free motion (RMS)", shown(m.tip_rms_m, "m"));
  write_fact(out, "force error without load (RMS)", shown(m.no_load_rms_N, "N"));
  write_fact(out, "contact force error", m.contact_error_rel ? shown(100 * *m.contact_error_rel, "%") : "-");
  write_fact(out, "hold error at the hand", shown(m.hold_error_N, "N"));
  write_fact(out, "rise time of the felt force", shown(m.rise_t90_s, "s"));
  write_fact(out, "payload",
             m.payload_estimate_kg
                 ? shown(m.payload_estimate_kg, "kg") + " (true " + shown(m.payload_truth_kg, "kg") + ")"
                 : "-");
  write_fact(out, "simulated time", shown(s.simulated_s, "s"));
  write_fact(out, "speed", s.wall_s > 0 ? shown(s.simulated_s / s.wall_s, "x real time") : "-");
  out << "</dl>\n";
}

/// Words, and the name by which scenarios and JSON call it.
std::string named_in_words(std::string_view name) {
  return escaped(metric_words(name)) + " <span class=\"soft\">" + escaped(std::string(name)) + "</span>";
}

void write_latencies(std::ostream& out, const std::vector<session::HopLatency>& hops) {
  if (hops.empty()) return;
  out << "<section><h2>Latencies</h2><p class=\"soft\">How old the data were, in the session's time.</p><div "
         "class=\"wide\"><table><tr><th>way<th class=\"n\">median<th class=\"n\">99 %<th class=\"n\">largest<th "
         "class=\"n\">samples</tr>\n";
  for (const session::HopLatency& hop : hops) {
    out << "<tr><td>" << escaped(hop_words(hop.hop));
    for (const double latency_us : {hop.latency_us.p50, hop.latency_us.p99, hop.latency_us.max})
      out << "<td class=\"n\">" << (hop.samples > 0 ? shown(1e-3 * latency_us, "ms") : "-");
    out << "<td class=\"n\">" << hop.samples << "</tr>\n";
  }
  out << "</table></div></section>\n";
}

void write_criteria(std::ostream& out, const std::vector<session::CriterionResult>& criteria) {
  if (criteria.empty()) return;
  out << "<section><h2>Criteria</h2><div class=\"wide\"><table><tr><th>what is asked<th class=\"n\">value<th "
         "class=\"n\">bound<th>verdict</tr>\n";
  for (const session::CriterionResult& c : criteria)
    out << "<tr><td>" << named_in_words(c.name) << "<td class=\"n\">" << escaped(shown(c.value, c.unit))
        << "<td class=\"n\">" << (c.relation == "max" ? "≤ " : "≥ ") << escaped(shown(c.bound, c.unit))
        << "<td class=\"" << (c.passed ? "ok\">✓ met" : "no\">✗ not met") << "</tr>\n";
  out << "</table></div></section>\n";
}

void write_happenings(std::ostream& out, const session::SessionResult& s) {
  if (s.notes.empty() && s.record.faults.empty()) return;
  out << "<section><h2>Faults and notes</h2><ul>";
  for (const session::FaultRecord& f : s.record.faults)
    out << "<li>" << shown(f.at_s, "s") << ": " << escaped(text(f.reason)) << "</li>\n";
  for (const std::string& note : s.notes) out << "<li>" << escaped(note) << "</li>\n";
  out << "</ul></section>\n";
}

void write_filmstrip(std::ostream& out, const session::SessionResult& session) {
  out << "<section><h2>Key moments</h2><p class=\"soft\">Drawn to scale. Arrows: contact force on the bucket tip,"
         "<span class=\"key\" style=\"color:var(--vermilion)\"></span>true force"
         "<span class=\"key\" style=\"color:var(--blue)\"></span>estimated. Blue line: path of the tip in the last 4 "
         "s.</p><div "
         "class=\"strip\">\n";
  for (const Frame& frame : filmstrip(session)) {
    out << "<figure>" << frame.svg
        << fmt::format("<figcaption><b>{:.1f} s</b> {}</figcaption></figure>\n", frame.t_s, escaped(frame.label));
  }
  out << "</div></section>\n";
}

void write_all_metrics(std::ostream& out, const session::Metrics& metrics) {
  out << "<section><h2>All metrics</h2><div class=\"wide\"><table><tr><th>group<th>metric<th class=\"n\">value</tr>\n";
  for (const session::MetricEntry& entry : session::metric_table())
    out << "<tr><td>" << entry.group << "<td>" << named_in_words(entry.name) << "<td class=\"n\">"
        << escaped(shown(metrics.*entry.member, std::string(entry.unit))) << "</tr>\n";
  out << "</table></div></section>\n";
}

}  // namespace

void check_report_tools() {
  check_gnuplot();
}

void write_report(const session::Judged& judged, const Origin& origin, std::ostream& out) {
  const session::SessionResult& session = judged.session;
  write_page_head(out, "Knuckle: " + session.scenario + ", seed " + std::to_string(session.seed), filmstrip_css());
  write_header(out, judged, origin);
  write_criteria(out, judged.criteria);
  write_happenings(out, session);
  if (session.record.samples.size() > 1) {
    write_filmstrip(out, session);
    write_figures(out, report_plots(session));
  }
  write_latencies(out, session.hops);
  write_all_metrics(out, judged.metrics);
  out << "<p class=\"soft\" style=\"margin-top:18px\">Knuckle " << KNUCKLE_VERSION
      << ". Digest of the run: <span class=\"digest\">" << session.digest << "</span></p>\n";
  write_page_end(out);
}

}  // namespace knuckle::report
