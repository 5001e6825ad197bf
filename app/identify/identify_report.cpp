#include <fmt/format.h>

#include <cmath>

#include "app/identify/identify_output.h"
#include "app/report/html.h"
#include "app/report/result_text.h"

namespace knuckle::identify {
namespace {

constexpr const char* kCss =
    ".nowrap{white-space:nowrap}ul{padding-left:1.2em;margin:6px 0}li{overflow-wrap:anywhere}"
    "td{vertical-align:top}@media(max-width:560px){section{padding:14px 12px}}";

std::string digits(double value, int significant = 4) {
  return report::number_text(value, significant);
}

/// Millimetres to a hundredth.
std::string fixed(double value) {
  return fmt::format("{:.2f}", value);
}

/// Boom, arm and bucket in one cell: a table that is narrow enough to be read.
std::string joints_cell(const JointVector& values, int significant) {
  return "<td class=\"n\">" + digits(values[0], significant) + " / " + digits(values[1], significant) + " / " +
         digits(values[2], significant);
}

/// "kg m^2" as people write it.
std::string unit_text(std::string unit) {
  if (const auto at = unit.find("^2"); at != std::string::npos) unit.replace(at, 2, "²");
  return unit == "1" ? "" : report::escaped(unit);
}

void fact(std::ostream& out, const std::string& what, const std::string& value) {
  out << "<div><dt>" << what << "</dt><dd>" << report::escaped(value) << "</dd></div>\n";
}

void write_header(std::ostream& out, const IdentifyData& data, const Identified& result) {
  out << "<h1>Identification of " << report::escaped(data.machine.name) << "</h1><p class=\"soft\">Method "
      << report::escaped(result.method) << "; " << report::escaped(data.source) << "</p>\n<span class=\"verdict"
      << (result.summary.usable ? "" : " bad") << "\">" << (result.summary.usable ? "Usable" : "Not usable")
      << "</span>\n<dl class=\"facts\">";
  fact(out, "identified from", digits(total_s(data.training), 3) + " s");
  fact(out, "held out", digits(total_s(data.hold_out), 3) + " s");
  if (result.summary.columns > 0) {
    fact(out, "rank", std::to_string(result.summary.rank) + " of " + std::to_string(result.summary.columns));
    fact(out, "condition number", digits(result.summary.condition_number, 3));
  }
  if (data.geometry && data.geometry->summary.usable)
    fact(out, "tip, held-out poses", digits(1e3 * data.geometry->held_out.rms_m, 2) + " mm RMS");
  out << "</dl>\n";
}

void write_list(std::ostream& out, const char* title, const std::vector<std::string>& lines) {
  if (lines.empty()) return;
  out << "<section><h2>" << title << "</h2><ul>";
  for (const std::string& line : lines) out << "<li>" << report::escaped(line) << "</li>\n";
  out << "</ul></section>\n";
}

void write_hold_out(std::ostream& out, const Identified& result) {
  if (result.hold_out.empty()) return;
  out << "<section><h2>Held-out motion</h2><p class=\"soft\">Joint torque of motion not used for identification, for "
         "boom / arm / bucket. NRMSE is the RMS of the error over the standard deviation of the measured torque, VAF "
         "the share of its variance that is explained; both to 2 Hz, NRMSE unfiltered beside it. A dash: the method "
         "has no model of this joint.</p><div class=\"wide\"><table><tr><th>recording<th>method<th class=\"n\">RMS, N "
         "m<th class=\"n\">NRMSE, %<th class=\"n\">unfiltered, %<th class=\"n\">VAF, %</tr>\n";
  for (const HoldOut& h : result.hold_out) {
    out << "<tr><td>" << report::escaped(h.source) << "<td>" << report::escaped(h.method)
        << joints_cell(h.to_2Hz.rms_Nm, 3) << joints_cell(100 * h.to_2Hz.nrmse, 2)
        << joints_cell(100 * h.unfiltered.nrmse, 2) << joints_cell(100 * h.to_2Hz.vaf, 4) << "</tr>\n";
  }
  out << "</table></div></section>\n";
}

/// How far drawing and machine are apart, in the identified value's own uncertainty.
void write_parameters(std::ostream& out, const Identified& result) {
  if (result.summary.parameters.empty()) return;
  const bool has_nominal = !result.nominal.empty();
  out << "<section><h2>Parameters" << (has_nominal ? ": drawing and machine" : "") << "</h2><p class=\"soft\">"
      << (has_nominal
              ? "J, X, Z: inertia and first moments of boom (1), arm (2), bucket (3), later links' masses at the "
                "joint included. Difference: identified minus drawing over sigma; beyond 2 the machine differs "
                "from its drawing. "
              : "")
      << "Sigma: " << report::escaped(sigma_text(result))
      << ".</p><div class=\"wide\"><table><tr><th>parameter<th "
         "class=\"n\">value<th "
         "class=\"n\">sigma<th>unit";
  if (has_nominal) out << "<th class=\"n\">drawing<th class=\"n\">difference, sigma";
  out << "</tr>\n";
  for (std::size_t i = 0; i < result.summary.parameters.size(); ++i) {
    const estimation::IdentifiedParameter& p = result.summary.parameters[i];
    out << "<tr><td class=\"nowrap\">" << report::escaped(p.name) << (p.fixed ? " (from the machine file)" : "")
        << "<td class=\"n\">" << digits(p.value) << "<td class=\"n\">" << digits(p.sigma, 2) << "<td class=\"nowrap\">"
        << unit_text(p.unit);
    if (has_nominal) {
      const double difference = p.sigma > 0 ? (p.value - result.nominal[i]) / p.sigma : std::nan("");
      out << "<td class=\"n\">" << digits(result.nominal[i]) << "<td class=\"n"
          << (std::abs(difference) > 2 ? " no" : "") << "\">" << digits(difference, 2);
    }
    out << "</tr>\n";
  }
  out << "</table></div></section>\n";
}

void write_geometry(std::ostream& out, const IdentifyData& data) {
  if (!data.geometry) return;
  const estimation::GeometryResult& geometry = *data.geometry;
  out << "<section><h2>Geometry</h2><p class=\"soft\">Surveyed tip position against the one computed from the "
         "encoders, each pose predicted by a fit to the others. "
      << (geometry.summary.usable ? "" : "Not usable: the drawing's geometry is used.")
      << "</p><div class=\"wide\"><table><tr><th><th class=\"n\">poses<th class=\"n\">tip RMS, mm<th "
         "class=\"n\">median<th class=\"n\">95 %</tr>\n";
  for (const auto& [name, error] : {std::pair{"drawing", geometry.nominal}, {"calibrated", geometry.held_out}}) {
    out << "<tr><td>" << name << "<td class=\"n\">" << error.poses << "<td class=\"n\">" << digits(1e3 * error.rms_m, 3)
        << "<td class=\"n\">" << digits(1e3 * error.median_m, 3) << "<td class=\"n\">" << digits(1e3 * error.p95_m, 3)
        << "</tr>\n";
  }
  out << "</table></div><div class=\"wide\"><table><tr><th>length or pin<th class=\"n\">value<th class=\"n\">sigma<th>"
         "unit</tr>\n";
  for (const estimation::IdentifiedParameter& p : geometry.summary.parameters)
    out << "<tr><td class=\"nowrap\">" << report::escaped(p.name) << "<td class=\"n\">" << fixed(p.value)
        << "<td class=\"n\">" << fixed(p.sigma) << "<td>" << report::escaped(p.unit) << "</tr>\n";
  out << "</table></div></section>\n";
}

void write_valves(std::ostream& out, const IdentifyData& data, const Identified& result) {
  if (!result.valves) return;
  out << "<section><h2>Valves</h2><p class=\"soft\">Dead bands as share of spool stroke, delay from command to first "
         "motion, flow at the pressure drop of the machine file; the drawing's value in brackets.</p><div "
         "class=\"wide\"><table><tr><th>axis<th class=\"n\">extend<th class=\"n\">retract<th class=\"n\">delay, ms<th "
         "class=\"n\">flow, L/min<th>verdict</tr>\n";
  constexpr double kLitresPerMinute = 6e4;
  for (std::size_t j = 0; j < kJoints; ++j) {
    const ValveCalibration& found = result.valves->valves[j];
    const ValveDescription& nominal = data.machine.cylinders[j].valve;
    const estimation::Identification& axis = result.valves->axes[j];
    const auto cell = [&](double value, double in_file) {
      out << "<td class=\"n\">" << digits(value, 3) << " (" << digits(in_file, 3) << ")";
    };
    out << "<tr><td>" << kJointNames[j];
    cell(found.dead_band_extend, nominal.dead_band_extend);
    cell(found.dead_band_retract, nominal.dead_band_retract);
    cell(1e3 * found.delay_s, 1e3 * nominal.delay_s);
    cell(kLitresPerMinute * found.nominal_flow_m3ps, kLitresPerMinute * nominal.nominal_flow_m3ps);
    out << "<td>"
        << (axis.usable || axis.reasons.empty()
                ? "usable"
                : report::escaped("the drawing's values are kept: " + axis.reasons.front()))
        << "</tr>\n";
  }
  out << "</table></div></section>\n";
}

void write_provenance_line(std::ostream& out, const CalibrationProvenance& from) {
  out << "<p class=\"soft\" style=\"margin-top:18px\">" << report::escaped(from.program) << ", "
      << report::escaped(from.date) << ". SHA-256 of the data: <span class=\"digest\">"
      << report::escaped(from.data_sha256) << "</span></p>\n";
}

}  // namespace

void write_identify_report(const IdentifyData& data, const Identified& result, std::ostream& out) {
  report::write_page_head(out, "Knuckle: identification of " + data.machine.name, kCss);
  write_header(out, data, result);
  write_list(out, result.summary.usable ? "Before using it" : "Why it is not usable", result.summary.reasons);
  write_list(out, "Cannot be separated", result.summary.indistinct);
  write_hold_out(out, result);
  report::write_figures(out, torque_figures(data, result));
  write_parameters(out, result);
  report::write_figures(out, friction_figures(result));
  write_valves(out, data, result);
  write_geometry(out, data);
  report::write_figures(out, data_figures(data));
  write_list(out, "Found in the data", data.findings);
  write_provenance_line(out, *result.machine.calibration_provenance);
  report::write_page_end(out);
}

}  // namespace knuckle::identify
