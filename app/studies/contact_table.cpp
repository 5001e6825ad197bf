#include "app/studies/contact_table.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

#include "app/cli/command.h"

namespace knuckle::studies {
namespace {

constexpr double kPress_N = 1800, kDeepest_m = 0.08;

using Json = nlohmann::ordered_json;

Json json_of(const BorderPair& pair) {
  Json json{{"measured_N_per_m", pair.measured_N_per_m}, {"measured_Hz", pair.measured_Hz}};
  json["predicted_N_per_m"] = pair.predicted ? Json(pair.predicted->stiffness_N_per_m) : Json(nullptr);
  json["predicted_Hz"] = pair.predicted ? Json(pair.predicted->frequency_Hz) : Json(nullptr);
  json["ratio"] = pair.ratio();
  json["passed"] = pair.within_bound();
  return json;
}

Json json_of(const ContactRow& row) {
  const auto number = [](bool known, double value) { return known ? Json(value) : Json(nullptr); };
  const bool margins = row.margins.has_value();
  return {{"pose", row.cell.pose.name},
          {"wall_N_per_m", row.cell.wall_N_per_m},
          {"small_signal", json_of(row.small)},
          {"with_dead_band", json_of(row.large)},
          {"crossover_Hz", number(margins, margins ? row.margins->crossover_Hz : 0)},
          {"phase_margin_deg", number(margins, margins ? row.margins->phase_margin_deg : 0)},
          {"lasting_swing_N", number(row.lasting_swing_N.has_value(), row.lasting_swing_N.value_or(0))},
          {"hold",
           {{"calm", row.at_file.calm},
            {"swing_N", row.at_file.late_N},
            {"frequency_Hz", row.at_file.frequency_Hz},
            {"bounces", row.at_file.bounces},
            {"peak_N", row.at_file.peak_N},
            {"touch_N", row.touch_N}}}};
}

std::string cell_of(const BorderPair& pair) {
  std::ostringstream out;
  out << std::setprecision(3) << std::setw(8) << pair.measured_N_per_m / 1e3 << std::setw(8)
      << (pair.predicted ? pair.predicted->stiffness_N_per_m / 1e3 : 0) << std::setw(6) << std::fixed
      << std::setprecision(2) << pair.ratio() << (pair.within_bound() ? ' ' : '*') << std::setw(5)
      << std::setprecision(1) << pair.measured_Hz << std::setw(5) << (pair.predicted ? pair.predicted->frequency_Hz : 0)
      << " |";
  return out.str();
}

double touch_N(const ContactTrial& trial, const HoldSwing& hold) {
  return hold.touch_mps * std::sqrt(trial.wall_N_per_m * ContactLoop(trial.machine, hold.hold).effective_mass_kg());
}

}  // namespace

ContactTrial trial_of(const MachineDescription& machine, const ContactCell& cell, Valves valves, std::uint64_t seed) {
  ContactTrial trial;
  trial.machine = with_valves(machine, valves);
  trial.truth = sim::nominal_truth(trial.machine);
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
  const double stiffness = machine.control.tip_stiffness_N_per_m;
  const ContactTrial ideal = trial_of(machine, cell, Valves::kIdeal, seed);
  const MeasuredBorder small = measure_border(ideal);
  row.small = {small.stiffness_N_per_m, small.swinging.frequency_Hz, {}};
  if (small.calm.calm) {
    const ContactLoop loop(ideal.machine, small.calm.hold);
    row.small.predicted = loop.border();
    row.margins = loop.margins(stiffness);
  }
  const ContactTrial as_on_file = trial_of(machine, cell, Valves::kAsOnFile, seed);
  const MeasuredBorder large = measure_border(as_on_file);
  row.large = {large.stiffness_N_per_m, large.swinging.frequency_Hz, {}};
  if (large.calm.calm) {
    const ContactLoop loop(as_on_file.machine, large.calm.hold);
    row.large.predicted = loop.border_with_dead_band(as_on_file.press_N + as_on_file.step_N);
    row.lasting_swing_N = loop.lasting_swing_N(stiffness);
  }
  row.at_file = judge_hold(as_on_file, run_contact(as_on_file));
  row.touch_N = touch_N(as_on_file, row.at_file);
  return row;
}

void print_contact_rows(const std::vector<ContactRow>& rows, double stiffness_N_per_m, std::ostream& out) {
  out << "border: tip stiffness Ks [kN/m] below which the hold swings, measured, predicted, ratio (*: out of "
         "0.8-1.25), "
         "frequency [Hz] measured, predicted\n"
      << "hold: at Ks = " << stiffness_N_per_m / 1e3 << " kN/m, valves as on file\n"
      << std::setw(9) << "pose" << std::setw(7) << "wall"
      << "  | small signals" << std::setw(19) << '|' << " with dead band" << std::setw(18) << '|'
      << " margin | swing that lasts | hold: swing, bounces, peak, touch [N]\n";
  for (const ContactRow& row : rows) {
    std::ostringstream margin, lasting;
    if (row.margins) margin << std::lround(row.margins->phase_margin_deg) << " deg";
    if (row.lasting_swing_N) lasting << "+-" << std::lround(*row.lasting_swing_N) << " N";
    out << std::setw(9) << row.cell.pose.name << std::setw(7) << std::setprecision(0) << std::scientific
        << row.cell.wall_N_per_m << std::defaultfloat << " |" << cell_of(row.small) << cell_of(row.large)
        << std::setw(8) << margin.str() << " |" << std::setw(17) << lasting.str() << " |" << std::setw(6)
        << std::lround(row.at_file.late_N) << std::setw(4) << row.at_file.bounces << std::setw(7)
        << std::lround(row.at_file.peak_N) << std::setw(7) << std::lround(row.touch_N)
        << (row.at_file.calm ? "" : "  swings") << '\n';
  }
  const auto share = [&](BorderPair ContactRow::*pair) {
    return std::count_if(rows.begin(), rows.end(), [&](const ContactRow& row) { return (row.*pair).within_bound(); });
  };
  out << "within 0.8-1.25: small signals " << share(&ContactRow::small) << " of " << rows.size() << ", with dead band "
      << share(&ContactRow::large) << " of " << rows.size() << '\n';
}

void write_contact_rows(const std::vector<ContactRow>& rows, const MachineDescription& machine, std::ostream& out) {
  Json json{{"schema", kContactLoopSchema},
            {"version", cli::program_version()},
            {"machine", machine.name},
            {"tip_stiffness_N_per_m", machine.control.tip_stiffness_N_per_m},
            {"bound", {BorderPair::kLeastRatio, BorderPair::kMostRatio}},
            {"passed", all_within_bound(rows)},
            {"rows", Json::array()}};
  for (const ContactRow& row : rows) json["rows"].push_back(json_of(row));
  out << json.dump(2) << '\n';
}

bool all_within_bound(const std::vector<ContactRow>& rows) {
  return std::all_of(rows.begin(), rows.end(), [](const ContactRow& row) { return row.small.within_bound(); });
}

}  // namespace knuckle::studies
