#include "app/identify/identify_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string_view>
#include <utility>

#include "app/cli/json.h"
#include "app/report/plots.h"
#include "core/units.h"
#include "machine/kinematics.h"

namespace knuckle::identify {
namespace {

using cli::Json;

constexpr int kSchema = 1;
constexpr std::size_t kFindingsShown = 12;

Json finite_or_null(double value) {
  return std::isfinite(value) ? Json(value) : Json();
}

Json joints(const JointVector& values) {
  return {
      {"boom", finite_or_null(values[0])}, {"arm", finite_or_null(values[1])}, {"bucket", finite_or_null(values[2])}};
}

Json fit_json(const estimation::TorqueFit& fit) {
  return {{"rms_Nm", joints(fit.rms_Nm)}, {"nrmse", joints(fit.nrmse)}, {"vaf", joints(fit.vaf)}};
}

Json geometry_json(const estimation::GeometryResult& geometry) {
  return {{"usable", geometry.summary.usable},
          {"poses", geometry.held_out.poses},
          {"tip_rms_mm", geometry.summary.usable ? finite_or_null(1e3 * geometry.held_out.rms_m) : Json()},
          {"drawing_tip_rms_mm", geometry.summary.usable ? finite_or_null(1e3 * geometry.nominal.rms_m) : Json()}};
}

Json valves_json(const estimation::ValveResult& valves) {
  Json json = Json::object();
  for (std::size_t j = 0; j < kJoints; ++j) {
    Json axis{{"usable", valves.axes[j].usable}, {"reasons", valves.axes[j].reasons}};
    for (const estimation::IdentifiedParameter& p : valves.axes[j].parameters)
      axis[p.name] = {{"value", finite_or_null(p.value)}, {"sigma", finite_or_null(p.sigma)}};
    json[kJointNames[j]] = axis;
  }
  return json;
}

Json parameters_json(const IdentifyData& data, const Identified& result) {
  Json list = Json::array();
  for (std::size_t i = 0; i < result.summary.parameters.size(); ++i) {
    const estimation::IdentifiedParameter& p = result.summary.parameters[i];
    const double nominal = i < result.nominal.size() ? result.nominal[i] : std::nan("");
    Json parameter{{"name", p.name},
                   {"unit", p.unit},
                   {"value", finite_or_null(p.value)},
                   {"sigma", finite_or_null(p.sigma)},
                   {"fixed", p.fixed},
                   {"drawing", finite_or_null(nominal)}};
    if (const auto truth = data.truth.find(p.name); truth != data.truth.end())
      parameter["truth"] = finite_or_null(truth->second);
    list.push_back(std::move(parameter));
  }
  return list;
}

Json bias_json(const std::vector<InertiaBias>& bias) {
  Json list = Json::array();
  for (const InertiaBias& row : bias) {
    list.push_back({{"variant", row.variant},
                    {"bucket", row.bucket},
                    {"stick", row.stick},
                    {"intervals", row.intervals},
                    {"covered", row.covered}});
  }
  return list;
}

/// "boom F_b, k and X1 only together: boom F_b + 2 k; X1" as one line a combination.
std::string unseen_text(const std::string& combination) {
  static constexpr std::string_view kTogether = " only together: ";
  const std::size_t at = combination.find(kTogether);
  if (at == std::string::npos) return "  " + combination + "\n";
  std::string text = "  cannot be separated: " + combination.substr(0, at) + "; the data determine only\n";
  for (std::size_t from = at + kTogether.size(), end; from < combination.size(); from = end + 2) {
    end = std::min(combination.find("; ", from), combination.size());
    text += "    the sum " + combination.substr(from, end - from) + "\n";
  }
  return text;
}

bool is_unseen(const Identified& result, const std::string& reason) {
  const std::vector<std::string>& unseen = result.summary.indistinct;
  return std::find(unseen.begin(), unseen.end(), reason) != unseen.end();
}

/// The head of such a reason: which parameters, without the sums that are listed below it.
std::string short_reason(const Identified& result) {
  const std::string& reason = result.summary.reasons.front();
  const std::size_t at = reason.find(" only together: ");
  if (!is_unseen(result, reason) || at == std::string::npos) return reason;
  return "the data cannot separate " + reason.substr(0, at);
}

}  // namespace

std::vector<double> times(std::size_t count, double step_s) {
  std::vector<double> t;
  for (std::size_t i = 0; i < count; ++i) t.push_back(step_s * static_cast<double>(i));
  return t;
}

std::vector<double> torque_series(const estimation::TorqueComparison& comparison,
                                  const std::vector<JointVector>& values, int joint, double unit_Nm) {
  std::vector<double> series;
  for (std::size_t i = 0; i < values.size(); ++i)
    series.push_back(comparison.usable[i] != 0 ? values[i][joint] / unit_Nm : kUnknown);
  return series;
}

JointSeries joint_series(const MachineDescription& machine, const estimation::Recording& recording, int joint) {
  const Kinematics kinematics(machine);
  const auto k = static_cast<std::size_t>(joint);
  JointSeries series{times(recording.samples.size(), recording.step_s), {}, {}, {}};
  for (std::size_t i = 0; i < recording.samples.size(); ++i) {
    const estimation::Measurement& m = recording.samples[i];
    const bool usable = recording.usable[i] != 0;
    const auto angle = kinematics.joint_at(joint, m.cylinder_m[joint] - machine.sensors.encoder_offset_m[joint]);
    series.angle_deg.push_back(usable && angle ? *angle / kDegree : kUnknown);
    series.head_bar.push_back(usable ? m.pressure_Pa[2 * k] / kBar : kUnknown);
    series.rod_bar.push_back(usable ? m.pressure_Pa[2 * k + 1] / kBar : kUnknown);
  }
  return series;
}

double total_s(const std::vector<estimation::Recording>& recordings) {
  double sum = 0;
  for (const estimation::Recording& r : recordings) sum += r.duration_s();
  return sum;
}

std::string verdict(const Identified& result) {
  if (result.summary.usable) return "usable";
  return "usable: no" + (result.summary.reasons.empty() ? "" : " - " + short_reason(result));
}

std::string sigma_text(const Identified& result) {
  using Sigmas = estimation::Identification::Sigmas;
  switch (result.summary.sigmas) {
    case Sigmas::kWithModelError:
      return "standard deviations with the model's own error, measured on an ensemble of simulated machines";
    case Sigmas::kWithUsualErrors:
      return "standard deviations; those of base parameters contain usual errors of sensors, lengths and the friction "
             "law";
    case Sigmas::kOfResiduals:
      break;
  }
  return "standard deviations without model error: too small";
}

std::string identify_summary(const IdentifyData& data, const Identified& result) {
  const estimation::Identification& summary = result.summary;
  std::string text = result.method + " on " + data.machine.name + ": " + verdict(result) + "\n";
  text += fmt::format("  data: {}; {:.0f} s to identify from, {:.0f} s held out\n", data.source, total_s(data.training),
                      total_s(data.hold_out));
  for (std::size_t i = summary.usable ? 0 : 1; i < summary.reasons.size(); ++i) {
    if (!is_unseen(result, summary.reasons[i])) text += "  note: " + summary.reasons[i] + "\n";  // else listed below
  }
  if (data.geometry && !data.geometry->summary.usable) {
    text += "  geometry: survey not used, the drawing's geometry is\n";
  } else if (data.geometry) {
    text += fmt::format("  geometry: tip error {:.1f} mm RMS on held-out poses, {:.1f} mm with the drawing\n",
                        1e3 * data.geometry->held_out.rms_m, 1e3 * data.geometry->nominal.rms_m);
  }
  if (summary.columns > 0)
    text += fmt::format("  rank {} of {}, condition number {:.3g}\n", summary.rank, summary.columns,
                        summary.condition_number);
  for (const std::string& combination : summary.indistinct) text += unseen_text(combination);
  for (std::size_t j = 0; j < kJoints && result.valves; ++j) {
    const ValveCalibration& valve = result.valves->valves[j];
    if (result.valves->axes[j].usable)
      text += fmt::format("  {} valve: dead band {:.3f}/{:.3f}, delay {:.0f} ms\n", kJointNames[j],
                          valve.dead_band_extend, valve.dead_band_retract, 1e3 * valve.delay_s);
    else {
      text += std::string("  ") + kJointNames[j] + " valve: the drawing's values are kept\n";
      for (const std::string& reason : result.valves->axes[j].reasons) text += "    " + reason + "\n";
    }
  }
  for (const HoldOut& held : result.hold_out) {
    if (held.method != result.method) continue;  // the papers' are in report and JSON, to compare with
    std::string percent;
    for (const double nrmse : held.judged().nrmse)
      percent += (percent.empty() ? "" : "/") + (std::isfinite(nrmse) ? fmt::format("{:.1f}", 100 * nrmse) : "-");
    text += "  " + held.method + " on " + held.source + ", boom/arm/bucket: torque error " + percent +
            (held.filtered() ? " % to 2 Hz\n" : " % unfiltered\n");
  }
  if (!summary.parameters.empty()) text += "  sigma: " + sigma_text(result) + "\n";
  for (std::size_t i = 0; i < std::min(kFindingsShown, data.findings.size()); ++i)
    text += "  " + data.findings[i] + "\n";
  if (data.findings.size() > kFindingsShown)
    text += fmt::format("  and {} more, all in the report\n", data.findings.size() - kFindingsShown);
  return text;
}

void write_identify_json(const IdentifyData& data, const Identified& result, std::ostream& out) {
  const estimation::Identification& summary = result.summary;
  const CalibrationProvenance& from = *result.machine.calibration_provenance;
  Json json{{"schema", kSchema},
            {"version", from.program},
            {"command", "identify"},
            {"machine", data.machine.name},
            {"method", result.method},
            {"usable", summary.usable},
            {"reasons", summary.reasons},
            {"date", from.date},
            {"data",
             {{"source", data.source},
              {"sha256", data.sha256},
              {"identified_s", total_s(data.training)},
              {"held_out_s", total_s(data.hold_out)},
              {"findings", data.findings}}},
            {"rank", summary.rank},
            {"columns", summary.columns},
            {"condition_number", finite_or_null(summary.condition_number)},
            {"indistinct", summary.indistinct},
            {"model_error", summary.sigmas == estimation::Identification::Sigmas::kWithModelError},
            {"parameters", parameters_json(data, result)}};
  Json held = Json::array();
  for (const HoldOut& h : result.hold_out) {
    held.push_back({{"source", h.source},
                    {"method", h.method},
                    {"to_2Hz", fit_json(h.to_2Hz)},
                    {"unfiltered", fit_json(h.unfiltered)},
                    {"tip_force_rms_N", finite_or_null(h.tip_force_N)},
                    {"tip_wrench_rms_N", finite_or_null(h.tip_wrench_N)}});
  }
  json["hold_out"] = held;
  if (!result.bias.empty()) json["inertia_bias"] = bias_json(result.bias);
  if (data.geometry) json["geometry"] = geometry_json(*data.geometry);
  if (result.valves) json["valves"] = valves_json(*result.valves);
  out << json.dump(2) << '\n';
}

namespace {

report::PageFigure torque_figure(const std::string& source, const estimation::TorqueComparison& c) {
  constexpr double kKilo = 1e3;
  report::PanelPlot plot;
  const std::vector<double> t = times(c.measured_Nm.size(), c.step_s);
  for (int j = 0; j < kJoints; ++j) {
    const std::string name = kJointNames[static_cast<std::size_t>(j)];
    const std::vector<double> measured = torque_series(c, c.measured_Nm, j, kKilo),
                              modelled = torque_series(c, c.modelled_Nm, j, kKilo);
    const bool known = std::any_of(measured.begin(), measured.end(), [](double m) { return std::isfinite(m); });
    if (!known) continue;  // nobody measures that cylinder's pressures
    std::vector<double> residual;
    for (std::size_t i = 0; i < t.size(); ++i) residual.push_back(kKilo * (measured[i] - modelled[i]));
    plot.panel(name + " torque, kN m");
    plot.line(t, measured, "measured", report::kGrey);
    plot.line(t, modelled, "modelled", report::kBlue);
    plot.panel(name + " error, N m");
    plot.line(t, residual, "measured - modelled", report::kVermilion, "lw 1");
  }
  return {"Torque: " + report::escaped(source),
          "Held-out motion: joint torque from cylinder pressures, torque of the identified model, and the difference.",
          plot.figure(t)};
}

/// F_f at a steady speed: Dahl state settled, no load.
double friction_N(const FrictionCalibration& f, double v_mps) {
  const double coulomb = v_mps > 0 ? f.coulomb_extend_N : -f.coulomb_retract_N;
  const double stribeck = std::copysign(f.breakaway_N, v_mps) * std::exp(-std::pow(v_mps / f.stribeck_mps, 2));
  return coulomb + stribeck + f.viscous_Ns_per_m * v_mps;
}

/// One standard deviation of it, by the gradient over the parameters.
double friction_sigma_N(const DynamicsCalibration& d, int joint, double v_mps) {
  CalibrationVector gradient = CalibrationVector::Zero();
  gradient[friction_index(joint, v_mps > 0 ? kCoulombExtend : kCoulombRetract)] = v_mps > 0 ? 1 : -1;
  gradient[friction_index(joint, kBreakaway)] =
      std::copysign(std::exp(-std::pow(v_mps / d.stribeck_mps[joint], 2)), v_mps);
  gradient[friction_index(joint, kViscous)] = v_mps;
  return std::sqrt(std::max(0.0, gradient.dot(d.covariance * gradient)));
}

FrictionCalibration nominal_friction(const FrictionDescription& f) {
  return {f.coulomb_N, f.coulomb_N, f.viscous_Ns_per_m, f.coulomb_N * (f.static_ratio - 1), f.stribeck_mps, 0};
}

/// gnuplot data block: speed [mm/s], then [kN] identified, low, high, drawing; a blank line where the direction
/// changes.
std::string friction_block(const MachineDescription& machine, int joint) {
  const DynamicsCalibration& dynamics = *machine.dynamics_calibration;
  const FrictionCalibration found = dynamics.friction(joint);
  const FrictionCalibration nominal = nominal_friction(machine.cylinders[static_cast<std::size_t>(joint)].friction);
  std::ostringstream block;
  constexpr int kPoints = 121;
  constexpr double kFastest_mps = 0.12;
  for (int i = 0; i < kPoints; ++i) {
    const double v = -kFastest_mps + 2 * kFastest_mps * i / (kPoints - 1);
    if (std::abs(v) < 1e-9) {
      block << '\n';
      continue;
    }
    const double force = 1e-3 * friction_N(found, v), sigma = 1e-3 * friction_sigma_N(dynamics, joint, v);
    block << 1e3 * v << ' ' << force << ' ' << force - 2 * sigma << ' ' << force + 2 * sigma << ' '
          << 1e-3 * friction_N(nominal, v) << '\n';
  }
  return block.str();
}

report::PageFigure data_figure(const MachineDescription& machine, const estimation::Recording& recording) {
  report::PanelPlot plot;
  for (int j = 0; j < kJoints; ++j) {
    const std::string name = kJointNames[static_cast<std::size_t>(j)];
    const JointSeries series = joint_series(machine, recording, j);
    plot.panel(name + ", deg");
    plot.line(series.t_s, series.angle_deg, "", report::kBlue);
    plot.panel(name + ", bar");
    plot.line(series.t_s, series.head_bar, "A, head side", report::kVermilion, "lw 1");
    plot.line(series.t_s, series.rod_bar, "B, rod side", report::kGreen, "lw 1");
  }
  return {"Data: " + report::escaped(recording.source),
          "Data used for identification: joint angles from the encoders, cylinder pressures. Gaps were not used.",
          plot.figure(times(recording.samples.size(), recording.step_s))};
}

}  // namespace

std::vector<report::PageFigure> torque_figures(const IdentifyData& data, const Identified& result) {
  std::vector<report::PageFigure> figures;
  for (std::size_t i = 0; i < result.comparisons.size(); ++i)
    figures.push_back(torque_figure(data.hold_out[i].source, result.comparisons[i]));
  return figures;
}

std::vector<report::PageFigure> friction_figures(const Identified& result) {
  if (!result.machine.dynamics_calibration || result.summary.parameters.empty()) return {};
  std::ostringstream data, plots;
  constexpr double kLeft = 0.07, kWidth = 0.25, kApart = 0.08;
  for (int j = 0; j < kJoints; ++j) {
    const std::string name = kJointNames[static_cast<std::size_t>(j)];
    data << "$" << name << " << EOD\n" << friction_block(result.machine, j) << "EOD\n";
    const double left = kLeft + j * (kWidth + kApart);
    plots << "set lmargin at screen " << left << "\nset rmargin at screen " << left + kWidth << "\nset ylabel '" << name
          << " friction, kN'\n"
          << (j == 1 ? "unset key\n" : "") << "plot $" << name << " using 1:3:4 with filledcurves fc rgb '"
          << report::kSky << "' fs transparent solid 0.35 noborder title '±2 sigma', $" << name
          << " using 1:2 with lines lc rgb '" << report::kBlue << "' lw 2 title 'identified', $" << name
          << " using 1:5 with lines lc rgb '" << report::kGrey << "' dt 2 lw 1.5 title 'drawing'\n";
  }
  return {{"Friction of the cylinders",
           "Without load, at a steady speed; extending to the right.",
           {900, 380,
            report::plot_style() + data.str() +
                "set multiplot\nset tmargin at screen 0.79\nset bmargin at screen 0.15\nset xlabel 'speed, mm/s'\n"
                "set xrange [-120:120]\nset xtics 60\nset key at screen 0.97, screen 0.98 right "
                "top\n" +
                plots.str() + "unset multiplot\n"}}};
}

std::vector<report::PageFigure> data_figures(const IdentifyData& data) {
  std::vector<report::PageFigure> figures;
  const MachineDescription machine = calibrated(data.machine);
  for (const estimation::Recording& recording : data.training) figures.push_back(data_figure(machine, recording));
  return figures;
}

}  // namespace knuckle::identify
