#include "app/identify/identify_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "app/cli/json.h"

namespace knuckle::identify {
namespace {

using cli::Json;

constexpr int kSchema = 1;
constexpr std::size_t kFindingsShown = 12;

double total_s(const std::vector<estimation::Recording>& recordings) {
  double sum = 0;
  for (const estimation::Recording& r : recordings) sum += r.duration_s();
  return sum;
}

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json();
}

Json joints(const JointVector& values) {
  return {{"boom", number(values[0])}, {"arm", number(values[1])}, {"bucket", number(values[2])}};
}

Json fit_json(const estimation::TorqueFit& fit) {
  return {{"rms_Nm", joints(fit.rms_Nm)}, {"nrmse", joints(fit.nrmse)}, {"vaf", joints(fit.vaf)}};
}

Json geometry_json(const estimation::GeometryResult& geometry) {
  return {{"usable", geometry.summary.usable},
          {"poses", geometry.held_out.poses},
          {"tip_rms_mm", geometry.summary.usable ? number(1e3 * geometry.held_out.rms_m) : Json()},
          {"drawing_tip_rms_mm", geometry.summary.usable ? number(1e3 * geometry.nominal.rms_m) : Json()}};
}

Json valves_json(const estimation::ValveResult& valves) {
  Json json = Json::object();
  for (std::size_t j = 0; j < kJoints; ++j) {
    Json axis{{"usable", valves.axes[j].usable}, {"reasons", valves.axes[j].reasons}};
    for (const estimation::IdentifiedParameter& p : valves.axes[j].parameters)
      axis[p.name] = {{"value", number(p.value)}, {"sigma", number(p.sigma)}};
    json[kJointNames[j]] = axis;
  }
  return json;
}

Json parameters_json(const IdentifyData& data, const Identified& result) {
  Json list = Json::array();
  for (std::size_t i = 0; i < result.summary.parameters.size(); ++i) {
    const estimation::IdentifiedParameter& p = result.summary.parameters[i];
    const double nominal = i < result.nominal.size() ? result.nominal[i] : std::nan("");
    Json parameter{{"name", p.name},           {"unit", p.unit},   {"value", number(p.value)},
                   {"sigma", number(p.sigma)}, {"fixed", p.fixed}, {"drawing", number(nominal)}};
    if (const auto truth = data.truth.find(p.name); truth != data.truth.end())
      parameter["truth"] = number(truth->second);
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
            {"condition_number", number(summary.condition_number)},
            {"indistinct", summary.indistinct},
            {"model_error", summary.sigmas == estimation::Identification::Sigmas::kWithModelError},
            {"parameters", parameters_json(data, result)}};
  Json held = Json::array();
  for (const HoldOut& h : result.hold_out) {
    held.push_back({{"source", h.source},
                    {"method", h.method},
                    {"to_2Hz", fit_json(h.to_2Hz)},
                    {"unfiltered", fit_json(h.unfiltered)},
                    {"tip_force_rms_N", number(h.tip_force_N)},
                    {"tip_wrench_rms_N", number(h.tip_wrench_N)}});
  }
  json["hold_out"] = held;
  if (!result.bias.empty()) json["inertia_bias"] = bias_json(result.bias);
  if (data.geometry) json["geometry"] = geometry_json(*data.geometry);
  if (result.valves) json["valves"] = valves_json(*result.valves);
  out << json.dump(2) << '\n';
}

}  // namespace knuckle::identify
