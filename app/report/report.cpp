#include "app/report/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <optional>
#include <vector>

#include "app/report/html.h"
#include "app/report/machine_drawing.h"
#include "app/report/result_text.h"
#include "machine/reason_text.h"

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

/// In the order of the table: what has a place in time has a number, which the plots show as well.
std::vector<const session::CriterionResult*> numbered(const Sorted& by) {
  std::vector<const session::CriterionResult*> results;
  for (const auto* part : {&by.failed, &by.shown, &by.towards})
    std::ranges::copy_if(*part, std::back_inserter(results),
                         [](const auto* result) { return result->at_s.has_value(); });
  return results;
}

/// Those at one time share a mark.
std::vector<PlotMark> marks_of(const Sorted& by) {
  constexpr double kNearMark_s = 0.5;
  std::vector<PlotMark> marks;
  const auto results = numbered(by);
  for (std::size_t i = 0; i < results.size(); ++i) {
    const std::string number = std::to_string(i + 1);
    const auto near = std::ranges::find_if(
        marks, [&](const PlotMark& mark) { return std::abs(mark.t_s - *results[i]->at_s) < kNearMark_s; });
    near == marks.end() ? marks.push_back({*results[i]->at_s, number}) : void(near->label += ", " + number);
  }
  return marks;
}

void write_verdict(std::ostream& out, const session::Judged& judged, const Sorted& by) {
  std::string verdict = verdict_text(judged);
  verdict[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(verdict[0])));
  out << "<span class=\"verdict"
      << (!judged.passed   ? " none"
          : *judged.passed ? ""
                           : " bad")
      << "\">" << verdict << "</span>\n<p class=\"lead\">" << escaped(done_text(judged)) << "</p>\n";
  if (by.towards.empty()) return;
  out << "<p>" << goals_text(judged) << ": ";
  for (const session::CriterionResult* goal : by.towards) {
    const std::string excuse = excuse_text(*goal, judged.metrics);
    out << (goal == by.towards.front() ? "" : "; ") << escaped(metric_text(goal->name)) << " ("
        << escaped(value_text(*goal)) << (excuse.empty() ? "" : "; " + excuse) << ")";
  }
  out << ".</p>\n";
}

/// Tiles of what there is.
void write_facts(std::ostream& out, const session::SessionResult& s, const session::Metrics& m) {
  out << "<dl class=\"facts\">";
  const auto fact = [&out](const std::string& what, const std::optional<double>& value, const std::string& unit) {
    if (value) write_fact(out, what, shown(value, unit));
  };
  fact("tip error in free motion (RMS)", m.tip_rms_m, "m");
  fact("force error without load (RMS)", m.no_load_rms_N, "N");
  if (m.contact_error_rel) write_fact(out, "contact force error", shown(100 * *m.contact_error_rel, "%"));
  fact("hold error at the hand", m.hold_error_N, "N");
  fact("rise time of the felt force", m.rise_t90_s, "s");
  if (m.payload_estimate_kg)
    write_fact(out, "payload (true: " + shown(m.payload_truth_kg, "kg") + ")", shown(m.payload_estimate_kg, "kg"));
  fact("simulated time", s.simulated_s, "s");
  if (s.wall_s > 0) write_fact(out, "speed", shown(s.simulated_s / s.wall_s, "x real time"));
  out << "</dl>\n";
}

void write_header(std::ostream& out, const session::Judged& judged, const Sorted& by, const Origin& origin) {
  const session::SessionResult& s = judged.session;
  out << "<h1>" << escaped(s.scenario) << "</h1>\n";
  write_verdict(out, judged, by);
  out << "<p class=\"soft\">" << escaped(s.machine_name) << ", seed " << s.seed << ", " << escaped(s.operator_name)
      << " operator, " << escaped(s.control) << " law"
      << (s.machine.force.contact_model == ContactModel::kBucketForce
              ? ""
              : std::string(", contact model ") + name(s.machine.force.contact_model))
      << "; link " << shown(s.delay_ms, "ms") << " one way, jitter " << shown(s.jitter_ms, "ms") << ", loss "
      << shown(100 * s.loss, "%") << (s.impairment.empty() ? "" : ", and more: " + escaped(s.impairment)) << "</p>\n";
  write_origin(out, origin);
  write_facts(out, s, judged.metrics);
}

/// Text, and the name by which scenarios and JSON call it.
std::string named_text(std::string_view name) {
  return escaped(metric_text(name)) + " <span class=\"soft\">" + escaped(std::string(name)) + "</span>";
}

void write_latencies(std::ostream& out, const std::vector<session::HopLatency>& hops) {
  if (hops.empty()) return;
  out << "<section><h2>Latencies</h2><p class=\"soft\">How old the data were, in the session's time.</p><div "
         "class=\"wide\"><table><tr><th>way<th class=\"n\">median<th class=\"n\">99 %<th class=\"n\">largest<th "
         "class=\"n\">samples</tr>\n";
  for (const session::HopLatency& hop : hops) {
    out << "<tr><td>" << escaped(hop_text(hop.hop));
    for (const double latency_us : {hop.latency_us.p50, hop.latency_us.p99, hop.latency_us.max})
      out << "<td class=\"n\">" << (hop.samples > 0 ? shown(1e-3 * latency_us, "ms") : "-");
    out << "<td class=\"n\">" << hop.samples << "</tr>\n";
  }
  out << "</table></div></section>\n";
}

const char* judgement(const session::CriterionResult& result, const session::SessionResult& session) {
  const bool goal = result.kind == session::CriterionKind::kGoal;
  if (!result.met) return "class=\"soft\">not judged";
  if (*result.met) return goal ? "class=\"ok\">✓ goal reached" : "class=\"ok\">✓ met";
  if (goal) return "class=\"soft\">goal not reached";
  return decides(result.kind, session.requirements_decide) ? "class=\"no\">✗ failed"
                                                           : "class=\"soft\">not met; does not decide here";
}

using Results = std::vector<const session::CriterionResult*>;

/// @param all those that have a number, in its order.
void write_bounds_table(std::ostream& out, const session::Judged& judged, const Results& results, const Results& all) {
  const session::SessionResult& session = judged.session;
  out << "<table class=\"bounds\"><thead><tr><th>what is asked<th class=\"n\">value<th class=\"n\">bound<th>when it "
         "was "
         "worst<th>verdict</tr></thead>\n";
  for (const session::CriterionResult* r : results) {
    const auto number = std::ranges::find(all, r);
    const bool in_plots = number != all.end() && session.record.samples.size() > 1;
    const std::string moment = escaped(moment_text(*r));
    out << "<tr><td>" << (in_plots ? "<b class=\"mark\">" + std::to_string(number - all.begin() + 1) + "</b> " : "")
        << named_text(r->name);
    if (const std::string excuse = excuse_text(*r, judged.metrics); !excuse.empty())
      out << "<br><span class=\"soft\">" << excuse << "</span>";
    out << "<td class=\"n\" data-of=\"value\">" << escaped(measured_text(*r)) << "<td class=\"n\" data-of=\"bound\">"
        << (r->relation == "max" ? "≤ " : "≥ ") << escaped(shown(r->bound, r->unit)) << "<td data-of=\"worst at\">";
    if (in_plots)
      out << "<a href=\"#" << anchor(plot_showing(r->name)) << "\">" << moment << "</a>";
    else
      out << moment;
    out << "<td " << judgement(*r, session) << "</tr>\n";
  }
  out << "</table>\n";
}

void write_bounds(std::ostream& out, const session::Judged& judged, const Sorted& by) {
  Results open, rest;
  for (const Results* part : {&by.failed, &by.shown, &by.towards}) open.insert(open.end(), part->begin(), part->end());
  for (const Results* part : {&by.met, &by.open}) rest.insert(rest.end(), part->begin(), part->end());
  if (open.empty() && rest.empty()) return;
  const Results all = numbered(by);
  out << "<section><h2>What was asked for</h2>";
  if (!open.empty()) write_bounds_table(out, judged, open, all);
  if (!rest.empty()) {
    out << "<details" << (open.empty() ? " open" : "") << "><summary>"
        << (by.met.empty() ? std::to_string(rest.size()) + " not judged" : std::to_string(by.met.size()) + " met")
        << "</summary>";
    write_bounds_table(out, judged, rest, all);
    out << "</details>";
  }
  out << "</section>\n";
}

constexpr const char* kCss = R"(.lead{font-size:1.15rem;margin:10px 0 4px}
.mark{display:inline-block;min-width:1.5em;text-align:center;border-radius:99px;color:var(--paper);background:var(--vermilion);font-size:.8rem}
a{color:var(--blue)}summary{cursor:pointer;margin-top:8px}
@media(max-width:600px){main{padding:16px 10px 40px}section{padding:14px 12px}.bounds thead{display:none}
.bounds tr{display:block;border-bottom:1px solid var(--rule);padding:8px 0}.bounds td{display:inline-block;border:0;padding:0 14px 0 0}
.bounds td:first-child,.bounds td:last-child{display:block}.bounds td:empty{display:none}
.bounds td[data-of]::before{content:attr(data-of) " ";color:var(--soft);font-size:.85rem}}
)";

void write_happenings(std::ostream& out, const session::SessionResult& s) {
  if (s.notes.empty() && s.record.faults.empty()) return;
  out << "<section><h2>Faults and notes</h2><ul>";
  for (const session::FaultRecord& f : s.record.faults)
    out << "<li>" << shown(f.at_s, "s") << ": " << escaped(text(f.reason, s.machine.bus)) << "</li>\n";
  for (const std::string& note : s.notes) out << "<li>" << escaped(note) << "</li>\n";
  out << "</ul></section>\n";
}

void write_filmstrip(std::ostream& out, const session::SessionResult& session) {
  out << "<section><h2>Key moments</h2><p class=\"soft\">Drawn to scale. Arrows: contact force,"
         "<span class=\"key\" style=\"color:var(--vermilion)\"></span>true, from where it acts,"
         "<span class=\"key\" style=\"color:var(--blue)\"></span>estimated, from where its line of action meets the "
         "bucket, with a pale band as wide as the line is unsure (95 %); from the tip where no line is known.  "
         "Intervals (±) are of 95 %; a torque is positive counter-clockwise. Blue line: path of the tip in the last 4 "
         "s.</p><div "
         "class=\"strip\">\n";
  for (const Frame& frame : filmstrip(session)) {
    out << "<figure>" << frame.svg << fmt::format("<figcaption><b>{:.1f} s</b> {}", frame.t_s, escaped(frame.label))
        << (frame.force.empty() ? "" : "<br>" + escaped(frame.force)) << "</figcaption></figure>\n";
  }
  out << "</div></section>\n";
}

void write_all_metrics(std::ostream& out, const session::Metrics& metrics) {
  out << "<section><h2>All metrics</h2><div class=\"wide\"><table><tr><th>group<th>metric<th class=\"n\">value</tr>\n";
  for (const session::MetricEntry& entry : session::metric_table()) {
    if (!(metrics.*entry.member)) continue;
    out << "<tr><td>" << entry.group << "<td>" << named_text(entry.name) << "<td class=\"n\">"
        << escaped(shown(metrics.*entry.member, std::string(entry.unit))) << "</tr>\n";
  }
  out << "</table></div></section>\n";
}

}  // namespace

void write_report(const session::Judged& judged, const Origin& origin, std::ostream& out) {
  const session::SessionResult& session = judged.session;
  const Sorted by = sorted(judged);
  write_page_head(out, "Knuckle: " + session.scenario + ", seed " + std::to_string(session.seed),
                  filmstrip_css() + kCss);
  write_header(out, judged, by, origin);
  write_bounds(out, judged, by);
  write_happenings(out, session);
  if (session.record.samples.size() > 1) {
    write_filmstrip(out, session);
    write_figures(out, report_plots(session, marks_of(by)));
  }
  write_latencies(out, session.hops);
  write_all_metrics(out, judged.metrics);
  out << "<p class=\"soft\" style=\"margin-top:18px\">Knuckle " << KNUCKLE_VERSION
      << ". Digest of the run: <span class=\"digest\">" << session.digest.whole << "</span></p>\n";
  write_page_end(out);
}

}  // namespace knuckle::report
