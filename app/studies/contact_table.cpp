#include "app/studies/contact_table.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

#include "app/cli/command.h"
#include "app/cli/json.h"
#include "estimation/tare.h"

namespace knuckle::studies {
namespace {

constexpr double kPress_N = 1800, kDeepest_m = 0.08;

using cli::Json;

Json json_of(const BorderPair& pair) {
  Json json;
  json["measured"] = pair.measured.found ? Json(pair.measured.value) : Json(nullptr);
  json["measured_Hz"] = pair.measured.found ? Json(pair.measured.frequency_Hz) : Json(nullptr);
  json["predicted"] = pair.predicted ? Json(pair.predicted->value) : Json(nullptr);
  json["predicted_Hz"] = pair.predicted ? Json(pair.predicted->frequency_Hz) : Json(nullptr);
  json["passed"] = pair.within_bound();
  return json;
}

Json json_of(const HoldSwing& hold) {
  return {{"calm", hold.calm},       {"trouble", hold.trouble},
          {"swing_N", hold.late_N},  {"frequency_Hz", hold.frequency_Hz},
          {"bounces", hold.bounces}, {"peak_N", hold.peak_N}};
}

Json json_of(const ContactRow& row) {
  Json json{{"pose", row.cell.pose.name},
            {"wall_N_per_m", row.cell.wall_N_per_m},
            {"stiffness_border_N_per_m", json_of(row.stiffness)},
            {"crossover_border_radps", json_of(row.crossover)}};
  json["gain_margin"] = row.at_file ? Json(1 / row.at_file->gain) : Json(nullptr);
  json["crossover_Hz"] = row.margins ? Json(row.margins->crossover_Hz) : Json(nullptr);
  json["phase_margin_deg"] = row.margins ? Json(row.margins->phase_margin_deg) : Json(nullptr);
  json["hold_ideal_valves"] = json_of(row.small_at_file);
  json["hold"] = json_of(row.on_file);
  const MeasuredBorder& on_file = row.crossover_on_file;
  json["crossover_border_on_file_radps"] = on_file.found ? Json(on_file.value) : Json(nullptr);
  json["passed"] = row.passed();
  return json;
}

/// @param unit of the printed figures.
std::string cell_of(const BorderPair& pair, double unit) {
  std::ostringstream out;
  const auto figures = [&](bool found, double value, double frequency_Hz) {
    if (!found) {
      out << std::setw(7) << "none" << std::setw(5) << "";
      return;
    }
    out << std::setprecision(3) << std::setw(7) << value / unit << std::fixed << std::setprecision(1) << std::setw(5)
        << frequency_Hz << std::defaultfloat;
  };
  const PredictedBorder predicted = pair.predicted.value_or(PredictedBorder{});
  figures(pair.measured.found, pair.measured.value, pair.measured.frequency_Hz);
  figures(pair.predicted.has_value(), predicted.value, predicted.frequency_Hz);
  out << std::setw(6);
  if (pair.has_both()) {
    out << std::fixed << std::setprecision(2) << pair.ratio();
  } else {
    out << "";
  }
  out << (pair.within_bound() ? "  |" : "* |");
  return out.str();
}

}  // namespace

ContactTrial trial_of(const MachineDescription& machine, const ContactCell& cell, Valves valves, std::uint64_t seed) {
  ContactTrial trial;
  trial.machine = with_valves(machine, valves);
  trial.truth = sim::nominal_truth(trial.machine);
  // So short a trial does not show the estimator any other lag than it expects.
  for (sim::PressureSensorError& sensor : trial.truth.pressure) sensor.lag_s = estimation::kUsualLag_s;
  trial.pose = cell.pose;
  trial.wall_N_per_m = cell.wall_N_per_m;
  const double total_N = std::min(kPress_N, kDeepest_m * cell.wall_N_per_m);
  trial.step_N = total_N / 3;
  trial.press_N = total_N - trial.step_N;
  trial.seed = seed;
  return trial;
}

ContactRow contact_row(const MachineDescription& machine, const ContactCell& cell, std::uint64_t seed) {
  ContactRow row;
  row.cell = cell;
  const ContactTrial ideal = trial_of(machine, cell, Valves::kIdeal, seed);
  row.small_at_file = judge_hold(ideal, run_contact(ideal));
  if (!row.small_at_file.trouble.empty()) return row;
  row.stiffness.measured = measure_stiffness_border(ideal);
  row.crossover.measured = measure_crossover_border(ideal);
  if (const HoldSwing& calm = row.stiffness.measured.calm; calm.calm) {
    row.stiffness.predicted = stiffness_border(ideal.machine, calm.hold);
  }
  if (const HoldSwing& calm = row.crossover.measured.calm; calm.calm) {
    row.crossover.predicted = crossover_border(ideal.machine, calm.hold);
  }
  const ContactTrial on_file = trial_of(machine, cell, Valves::kAsOnFile, seed);
  row.on_file = judge_hold(on_file, run_contact(on_file));
  row.crossover_on_file = measure_crossover_border(on_file);
  if (!row.small_at_file.calm) return row;
  const ContactLoop loop(ideal.machine, row.small_at_file.hold);
  row.at_file = loop.crossing();
  row.margins = loop.margins();
  return row;
}

void print_contact_rows(const std::vector<ContactRow>& rows, const MachineDescription& machine, std::ostream& out) {
  const auto& control = machine.control;
  out << "Ks: least tip stiffness [kN/m] that is calm without bound of the crossover; crossover: largest\n"
      << "contact_crossover_radps that is calm at Ks = " << control.tip_stiffness_N_per_m / 1e3
      << " kN/m. Each measured, Hz, predicted, Hz, ratio (*: out of 0.8-1.25)\n"
      << "margins: predicted at Ks and contact_crossover_radps = " << control.contact_crossover_radps
      << "; valves as on file: largest crossover, hold: swing [N], bounces, peak [N]\n"
      << "     pose   wall |" << std::setw(32) << "Ks  "
      << "|" << std::setw(32) << "crossover  "
      << "|  gain phase | on file: hold\n";
  for (const ContactRow& row : rows) {
    std::ostringstream gain, phase, on_file;
    if (row.at_file) gain << std::setprecision(2) << 1 / row.at_file->gain;
    if (row.margins) phase << std::lround(row.margins->phase_margin_deg);
    if (row.crossover_on_file.found) on_file << std::setprecision(3) << row.crossover_on_file.value;
    out << std::setw(9) << row.cell.pose.name << std::setw(7) << std::setprecision(0) << std::scientific
        << row.cell.wall_N_per_m << std::defaultfloat << " |" << cell_of(row.stiffness, 1e3)
        << cell_of(row.crossover, 1) << std::setw(6) << gain.str() << std::setw(6) << phase.str() << " |"
        << std::setw(6) << (row.crossover_on_file.found ? on_file.str() : "none") << std::setw(6)
        << std::lround(row.on_file.late_N) << std::setw(4) << row.on_file.bounces << std::setw(7)
        << std::lround(row.on_file.peak_N) << (row.on_file.calm ? "" : "  swings")
        << (row.small_at_file.calm ? "" : "  swings with ideal valves")
        << (row.small_at_file.trouble.empty() ? "" : ": ") << row.small_at_file.trouble << '\n';
  }
  const auto share = [&](BorderPair ContactRow::*pair) {
    return std::count_if(rows.begin(), rows.end(), [&](const ContactRow& row) { return (row.*pair).within_bound(); });
  };
  out << "within 0.8-1.25: Ks " << share(&ContactRow::stiffness) << ", crossover " << share(&ContactRow::crossover)
      << " of " << rows.size() << '\n';
}

void write_contact_rows(const std::vector<ContactRow>& rows, const MachineDescription& machine, std::ostream& out) {
  Json json{{"schema", kContactLoopSchema},
            {"version", cli::program_version()},
            {"machine", machine.name},
            {"tip_stiffness_N_per_m", machine.control.tip_stiffness_N_per_m},
            {"contact_crossover_radps", machine.control.contact_crossover_radps},
            {"bound", {BorderPair::kLeastRatio, BorderPair::kMostRatio}},
            {"passed", all_passed(rows)},
            {"rows", Json::array()}};
  for (const ContactRow& row : rows) json["rows"].push_back(json_of(row));
  out << json.dump(2) << '\n';
}

bool all_passed(const std::vector<ContactRow>& rows) {
  return std::all_of(rows.begin(), rows.end(), [](const ContactRow& row) { return row.passed(); });
}

}  // namespace knuckle::studies
