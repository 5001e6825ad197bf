#include "app/report.h"

#include <cstdio>

#include "app/filmstrip.h"
#include "app/report_plots.h"
#include "app/summary.h"

namespace knuckle::app {
namespace {

constexpr const char* kStyle =
    R"(:root{color-scheme:light dark;--ink:#1d2429;--soft:#5a6670;--paper:#fff;--page:#f3f4f2;--rule:#dde1e3;
--blue:#0072b2;--vermilion:#d55e00;--good:#00795a;--bad:#b84a00;--hull:#d9a62e;--track:#4a5157;--link:#e8b53a;--bucket:#7b858d;
--edge:#343b41;--rod:#b9c2c9;--ground:#d3cdc1;--soil:#c2a988;--wall:#a9b0b5;--piece:#cc79a7}
@media(prefers-color-scheme:dark){:root{--ink:#e4e8ea;--soft:#9aa6ae;--paper:#1b2024;--page:#13171a;--rule:#333b41;
--blue:#4aa8de;--vermilion:#f08a3c;--good:#35b58f;--bad:#f08a3c;--track:#6a737a;--edge:#0e1114;--ground:#3b3934;--soil:#5b4a37;--wall:#59626a;--bucket:#8d989f}}
*{box-sizing:border-box}body{margin:0;background:var(--page);color:var(--ink);font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif}
main{max-width:1040px;margin:0 auto;padding:28px 18px 60px}h1{font-size:1.7rem;line-height:1.2;margin:0 0 4px}h2{font-size:1.12rem;margin:0 0 2px}
p{margin:0 0 10px}.soft,figcaption{color:var(--soft);font-size:.9rem}section{background:var(--paper);border:1px solid var(--rule);border-radius:10px;padding:18px 20px;margin-top:18px}
.verdict{display:inline-block;font-weight:650;border-radius:99px;padding:2px 14px;margin:10px 0 0;color:var(--paper);background:var(--good)}.verdict.bad{background:var(--bad)}
.facts{display:grid;grid-template-columns:repeat(auto-fill,minmax(150px,1fr));gap:12px 20px;margin:18px 0 0}.facts div{border-top:2px solid var(--rule);padding-top:6px}
dt{color:var(--soft);font-size:.82rem}dd{margin:0;font-size:1.12rem;font-variant-numeric:tabular-nums}
table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums}th{text-align:left;color:var(--soft);font-weight:500;font-size:.85rem}
td,th{padding:5px 12px 5px 0;border-bottom:1px solid var(--rule)}tr:last-child td{border-bottom:0}td.n,th.n{text-align:right;white-space:nowrap}.ok{color:var(--good)}.no{color:var(--bad);font-weight:650}
.wide{overflow-x:auto}.plot{min-width:620px}.plot svg{display:block;width:100%;height:auto}.plot svg text{font-family:inherit;fill:currentColor}
figure{margin:0}.strip{display:grid;grid-template-columns:repeat(auto-fill,minmax(285px,1fr));gap:16px}.strip figure{border:1px solid var(--rule);border-radius:8px;overflow:hidden}
.strip figcaption{padding:6px 10px;border-top:1px solid var(--rule)}.strip b{color:var(--ink);font-variant-numeric:tabular-nums}
.key{display:inline-block;width:22px;height:0;border-top:4px solid;vertical-align:middle;margin:0 4px 0 10px}.digest{overflow-wrap:anywhere;font-family:ui-monospace,monospace;font-size:.78rem}
@media print{body{background:#fff}section{break-inside:avoid;border:0;padding:8px 0}.strip{grid-template-columns:repeat(3,1fr)}.plot{min-width:0}}
)";

std::string escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '&':
        safe += "&amp;";
        break;
      case '"':
        safe += "&quot;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

void write_fact(std::ostream& out, const std::string& what, const std::string& value) {
  out << "<div><dt>" << what << "</dt><dd>" << escaped(value) << "</dd></div>\n";
}

void write_header(std::ostream& out, const Judged& judged) {
  const SessionResult& s = judged.session;
  const Metrics& m = judged.metrics;
  std::size_t met = 0;
  for (const CriterionResult& c : judged.criteria) met += c.passed ? 1 : 0;
  out << "<h1>" << escaped(s.scenario) << "</h1><p class=\"soft\">" << escaped(s.machine_name) << ", seed " << s.seed
      << ", " << escaped(s.operator_name) << " operator, " << escaped(s.control) << " law; link "
      << shown(s.delay_ms, "ms") << " one way, jitter " << shown(s.jitter_ms, "ms") << ", loss "
      << shown(100 * s.loss, "%") << "</p>\n<span class=\"verdict" << (judged.passed ? "" : " bad") << "\">"
      << (judged.passed ? "Passed" : "Not passed") << ": " << met << " of " << judged.criteria.size()
      << " criteria</span>\n<dl class=\"facts\">";
  write_fact(out, "tip error, free motion", shown(m.tip_rms_m, "m"));
  write_fact(out, "no-load force", shown(m.no_load_rms_N, "N"));
  write_fact(out, "contact force error", m.contact_error_rel ? shown(100 * *m.contact_error_rel, "%") : "-");
  write_fact(out, "hold error at the hand", shown(m.hold_error_N, "N"));
  write_fact(out, "felt force rises in", shown(m.rise_t90_s, "s"));
  write_fact(out, "payload",
             m.payload_estimate_kg
                 ? shown(m.payload_estimate_kg, "kg") + " (true " + shown(m.payload_truth_kg, "kg") + ")"
                 : "-");
  write_fact(out, "simulated", shown(s.simulated_s, "s"));
  write_fact(out, "speed", s.wall_s > 0 ? shown(s.simulated_s / s.wall_s, "x real time") : "-");
  out << "</dl>\n";
}

void write_criteria(std::ostream& out, const std::vector<CriterionResult>& criteria) {
  if (criteria.empty()) return;
  out << "<section><h2>Criteria</h2><div class=\"wide\"><table><tr><th>metric<th class=\"n\">value<th "
         "class=\"n\">bound<th>verdict</tr>\n";
  for (const CriterionResult& c : criteria)
    out << "<tr><td>" << escaped(c.name) << "<td class=\"n\">" << escaped(shown(c.value, c.unit)) << "<td class=\"n\">"
        << (c.relation == "max" ? "≤ " : "≥ ") << escaped(shown(c.bound, c.unit)) << "<td class=\""
        << (c.passed ? "ok\">✓ met" : "no\">✗ not met") << "</tr>\n";
  out << "</table></div></section>\n";
}

void write_happenings(std::ostream& out, const SessionResult& s) {
  if (s.notes.empty() && s.record.faults.empty()) return;
  out << "<section><h2>Faults and notes</h2><ul>";
  for (const FaultRecord& f : s.record.faults)
    out << "<li>" << shown(f.at_s, "s") << ": " << escaped(text(f.reason)) << "</li>\n";
  for (const std::string& note : s.notes) out << "<li>" << escaped(note) << "</li>\n";
  out << "</ul></section>\n";
}

void write_filmstrip(std::ostream& out, const SessionResult& session) {
  out << "<section><h2>Key moments</h2><p class=\"soft\">To scale. Arrows: force of the world on the bucket tip,"
         "<span class=\"key\" style=\"color:var(--vermilion)\"></span>true force"
         "<span class=\"key\" style=\"color:var(--blue)\"></span>estimated; the line is the tip's last 4 s.</p><div "
         "class=\"strip\">\n";
  for (const Frame& frame : filmstrip(session)) {
    char time[32];
    std::snprintf(time, sizeof time, "%.1f s", frame.t_s);
    out << "<figure>" << frame.svg << "<figcaption><b>" << time << "</b> " << escaped(frame.label)
        << "</figcaption></figure>\n";
  }
  out << "</div></section>\n";
}

void write_plots(std::ostream& out, const SessionResult& session) {
  const std::vector<ReportPlot> plots = report_plots(session);
  std::vector<Figure> figures;
  for (const ReportPlot& plot : plots) figures.push_back(plot.figure);
  const std::vector<std::string> svgs = render_svg(figures);
  for (std::size_t i = 0; i < plots.size(); ++i)
    out << "<section><figure><h2>" << plots[i].title << "</h2><figcaption>" << plots[i].caption
        << "</figcaption><div class=\"wide\"><div class=\"plot\">" << svgs[i] << "</div></div></figure></section>\n";
}

void write_all_metrics(std::ostream& out, const Metrics& metrics) {
  out << "<section><h2>All numbers</h2><div class=\"wide\"><table><tr><th>group<th>metric<th class=\"n\">value</tr>\n";
  for (const MetricEntry& entry : metric_table())
    out << "<tr><td>" << entry.group << "<td>" << entry.name << "<td class=\"n\">"
        << escaped(shown(metrics.*entry.member, std::string(entry.unit))) << "</tr>\n";
  out << "</table></div></section>\n";
}

}  // namespace

void check_report_tools() {
  check_gnuplot();
}

void write_report(const Judged& judged, std::ostream& out) {
  const SessionResult& session = judged.session;
  out << "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
         "content=\"width=device-width,initial-scale=1\">\n<title>Knuckle: "
      << escaped(session.scenario) << ", seed " << session.seed << "</title>\n<style>" << kStyle << filmstrip_css()
      << "</style></head><body><main>\n";
  write_header(out, judged);
  write_criteria(out, judged.criteria);
  write_happenings(out, session);
  if (session.record.samples.size() > 1) {
    write_filmstrip(out, session);
    write_plots(out, session);
  }
  write_all_metrics(out, judged.metrics);
  out << "<p class=\"soft\" style=\"margin-top:18px\">Knuckle " << KNUCKLE_VERSION
      << ". Digest of the run: <span class=\"digest\">" << session.digest << "</span></p>\n</main></body></html>\n";
}

}  // namespace knuckle::app
