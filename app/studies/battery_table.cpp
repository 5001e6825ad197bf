#include "app/studies/battery_table.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <sstream>

#include "core/quantile.h"

namespace knuckle::studies {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kTenMinutes_s = 600;
constexpr double kLeastTaken = 0.1;

using Values = std::vector<double>;

double share(double part, double whole) {
  return whole > 0 ? part / whole : kNaN;
}

std::string number(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

class Table {
 public:
  Table(std::string method, bool judged) : method_(std::move(method)), judged_(judged) {}

  void state(const std::string& quantity, double value, const std::string& unit) {
    if (!std::isnan(value)) rows_.push_back({quantity, method_, value, unit, "", std::nullopt});
  }
  void at_most(const std::string& quantity, double value, const std::string& unit, double bound) {
    judge(quantity, value, unit, "<= " + number(bound), value <= bound);
  }
  void at_least(const std::string& quantity, double value, const std::string& unit, double bound) {
    judge(quantity, value, unit, ">= " + number(bound), value >= bound);
  }
  void between(const std::string& quantity, double value, const std::string& unit, double low, double high) {
    judge(quantity, value, unit, number(low) + " to " + number(high), value >= low && value <= high);
  }
  [[nodiscard]] std::vector<BatteryRow> take() { return std::move(rows_); }

 private:
  void judge(const std::string& quantity, double value, const std::string& unit, const std::string& target, bool met) {
    if (!judged_) return state(quantity, value, unit);
    rows_.push_back({quantity, method_, value, unit, target, met});
  }

  std::string method_;
  bool judged_;
  std::vector<BatteryRow> rows_;
};

using Outcomes = std::vector<const MethodOutcome*>;

Values of(const Outcomes& outcomes, const std::function<double(const MethodOutcome&)>& value) {
  Values values;
  for (const MethodOutcome* outcome : outcomes) values.push_back(value(*outcome));
  return values;
}

void no_load_rows(const Outcomes& all, Table& table) {
  const Values slow = of(all, [](const auto& o) { return o.force.slow_rms_N; });
  table.at_most("no-load tip force, slow, RMS, median of machines", median(slow), "N", 30);
  table.at_most("no-load tip force, slow, RMS, p95 of machines", quantile(slow, 0.95), "N", 45);
  const Values tail = of(all, [](const auto& o) { return o.force.slow_p95_N; });
  table.at_most("no-load tip force, slow, 95 % of its size, p95 of machines", quantile(tail, 0.95), "N", 90);
  table.state("no-load tip force, slow, 95 % of its size, worst machine", quantile(tail, 1), "N");
  const Values digging = of(all, [](const auto& o) { return o.force.digging_rms_N; });
  table.at_most("no-load tip force, digging speed, RMS, median of machines", median(digging), "N", 45);
  table.at_most("no-load tip force, digging speed, RMS, p95 of machines", quantile(digging, 0.95), "N", 60);
}

using Pulls = std::vector<const std::vector<PressScore>*>;

void press_rows(const Pulls& all, Table& table, double bound) {
  for (const bool creeping : {false, true}) {
    int presses = 0, good = 0;
    int loads = 0;
    Values errors;
    for (const std::vector<PressScore>* pulls : all) {
      for (const PressScore& press : *pulls) {
        if (press.creeping != creeping) continue;  // one without an answer is one missed
        ++presses;
        loads += press.taken_for_load_N > kLeastTaken * press.force_N ? 1 : 0;
        good += press.good() ? 1 : 0;
        errors.push_back(press.error_N);
      }
    }
    const std::string which = creeping ? ", creeping" : ", standing";
    table.at_least("known force 1-5 kN within max(3 %, 60 N) and 3 deg" + which, share(good, presses), "1", bound);
    table.state("known force 1-5 kN, error, median" + which, median(errors), "N");
    table.state("known force 1-5 kN, error, p95" + which, quantile(errors, 0.95), "N");
    if (bound > 0)
      table.state("known force 1-5 kN, a tenth or more of it reported as load" + which, share(loads, presses), "1");
  }
}

Pulls pulls_of(const Outcomes& all) {
  Pulls pulls;
  for (const MethodOutcome* o : all) pulls.push_back(&o->force.presses);
  return pulls;
}

/// The other contact models with the same calibration; stated, as no target asks for them.
std::vector<BatteryRow> contact_model_rows(const std::string& method, const Outcomes& all) {
  std::vector<BatteryRow> rows;
  for (std::size_t m = 0; !all.empty() && m < all.front()->force.contact_models.size(); ++m) {
    Pulls pulls;
    Values torques, places;
    double asked = 0, answered = 0;
    for (const MethodOutcome* o : all) {
      const ContactModelScore& score = o->force.contact_models[m];
      pulls.push_back(&score.presses);
      torques.insert(torques.end(), score.torque_Nm.begin(), score.torque_Nm.end());
      places.insert(places.end(), score.place_error_m.begin(), score.place_error_m.end());
      for (const PressScore& press : score.presses) {
        ++asked;
        answered += std::isnan(press.error_N) ? 0 : 1;
      }
    }
    Table table(method + ", " + all.front()->force.contact_models[m].model, false);
    table.state("known force 1-5 kN, answered", share(answered, asked), "1");
    press_rows(pulls, table, 0);
    table.state("false torque about the tip, p95", quantile(torques, 0.95), "N m");
    table.state("position along the bucket, error, median", 1e3 * median(places), "mm");
    table.state("position along the bucket, error, p95", 1e3 * quantile(places, 0.95), "mm");
    const std::vector<BatteryRow> own = table.take();
    rows.insert(rows.end(), own.begin(), own.end());
  }
  return rows;
}

void torque_rows(const Outcomes& all, Table& table) {
  constexpr std::array<double, 3> kMedian{2.5, 2.5, 3};
  for (int i = 0; i < kJoints; ++i) {
    const std::string joint = kJointNames[static_cast<std::size_t>(i)];
    const Values smooth = of(all, [i](const auto& o) { return 100 * o.torque_2Hz.nrmse[i]; });
    const Values raw = of(all, [i](const auto& o) { return 100 * o.torque_raw.nrmse[i]; });
    table.at_most("held-out torque NRMSE to 2 Hz, " + joint + ", median", median(smooth), "%",
                  kMedian[static_cast<std::size_t>(i)]);
    table.at_most("held-out torque NRMSE to 2 Hz, " + joint + ", p95", quantile(smooth, 0.95), "%", 5);
    table.state("held-out torque NRMSE unfiltered, " + joint + ", median", median(raw), "%");
  }
}

void parameter_rows(const Outcomes& all, Table& table) {
  constexpr std::array<double, 3> kGravity{2, 2, 4};
  Outcomes with;
  std::copy_if(all.begin(), all.end(), std::back_inserter(with),
               [](const auto* o) { return o->parameters.has_value(); });
  if (with.empty()) return;
  int intervals = 0, covered = 0;
  for (const MethodOutcome* o : with) {
    intervals += o->parameters->intervals;
    covered += o->parameters->covered;
  }
  for (int i = 0; i < kJoints; ++i) {
    const std::string joint = kJointNames[static_cast<std::size_t>(i)];
    const Values gravity = of(with, [i](const auto& o) { return 100 * o.parameters->gravity[i]; });
    table.at_most("gravity moment error, " + joint + ", median", median(gravity), "%",
                  kGravity[static_cast<std::size_t>(i)]);
    table.state("gravity moment error, " + joint + ", p95", quantile(gravity, 0.95), "%");
  }
  for (int i = 0; i < kJoints; ++i) {
    const std::string joint = kJointNames[static_cast<std::size_t>(i)];
    const Values inertia = of(with, [i](const auto& o) { return 100 * o.parameters->inertia[i]; });
    const std::string quantity = "inertia error, " + joint + ", median";
    if (i == kBoom)
      table.at_most(quantity, median(inertia), "%", 6);
    else
      table.state(quantity, median(inertia), "%");
  }
  for (int i = 0; i < kJoints; ++i) {
    const Values friction = of(with, [i](const auto& o) { return 100 * o.parameters->friction[i]; });
    table.at_most(std::string("friction curve F_f(v) error, ") + kJointNames[static_cast<std::size_t>(i)] + ", median",
                  median(friction), "%", 3);
  }
  table.between("95 % intervals of base parameters that contain the true value", share(covered, intervals), "1", 0.90,
                0.99);
}

void honesty_rows(const Outcomes& all, Table& table) {
  int looks = 0, covered = 0, presses = 0, presses_covered = 0;
  for (const MethodOutcome* o : all) {
    looks += o->force.looks;
    covered += o->force.covered;
    for (const PressScore& press : o->force.presses) {
      ++presses;
      presses_covered += press.covered ? 1 : 0;
    }
  }
  if (looks == 0) return;
  table.between("95 % ellipse of the tip force contains the true force, free motion", share(covered, looks), "1", 0.90,
                0.99);
  table.between("95 % ellipse of the tip force contains the true force, known forces", share(presses_covered, presses),
                "1", 0.90, 0.99);
  table.state("NIS of the tare filter, mean per degree of freedom",
              median(of(all, [](const auto& o) { return o.force.nis; })), "1");
}

void contact_rows(const Outcomes& all, Table& table, double median_ms, double p95_ms) {
  Values seen_ms;
  double alarms = 0, free_s = 0;
  for (const MethodOutcome* o : all) {
    for (const double s : o->force.detection_s) seen_ms.push_back(1e3 * s);
    alarms += o->force.false_alarms;
    free_s += o->force.free_s;
  }
  if (seen_ms.empty()) return;
  table.at_most("500 N step seen after, median", median(seen_ms), "ms", median_ms);
  table.at_most("500 N step seen after, p95", quantile(seen_ms, 0.95), "ms", p95_ms);
  table.at_most("false contact alarms in 10 min of free motion", share(alarms * kTenMinutes_s, free_s), "1", 1);
}

void payload_rows(const Outcomes& all, double full_scale_kg, Table& table) {
  double squares = 0;
  int lifts = 0, inside = 0;
  for (const MethodOutcome* o : all) {
    for (std::size_t k = 0; k < o->force.payload_error_kg.size(); ++k) {
      const double error = o->force.payload_error_kg[k];
      squares += error * error;
      ++lifts;
      inside += std::abs(error) <= 1.96 * o->force.payload_sigma_kg[k] ? 1 : 0;
    }
  }
  if (lifts == 0) return;
  table.at_most("payload error, 2 sigma, of full scale, zeroed", 200 * std::sqrt(squares / lifts) / full_scale_kg, "%",
                1);
  table.state("payload 95 % interval contains the true load", share(inside, lifts), "1");
}

std::vector<BatteryRow> commissioning_rows(const std::vector<MachineOutcome>& machines) {
  Table table("commissioning", false);
  const auto value = [&](const std::string& quantity, double scale, const std::string& unit, const auto& of_scores) {
    Values values;
    for (const MachineOutcome& machine : machines) {
      if (machine.failure.empty()) values.push_back(scale * of_scores(machine.commissioning));
    }
    table.state(quantity + ", median", median(values), unit);
    table.state(quantity + ", p95", quantile(values, 0.95), unit);
  };
  value("held-out tip error, surveyed", 1e3, "mm", [](const auto& s) { return s.tip_median_m; });
  value("held-out tip error, nominal", 1e3, "mm", [](const auto& s) { return s.nominal_tip_median_m; });
  for (int i = 0; i < kJoints; ++i) {
    const std::string joint = kJointNames[static_cast<std::size_t>(i)];
    value("lever error, surveyed, " + joint, 100, "%", [i](const auto& s) { return s.lever[i]; });
    value("lever error, nominal, " + joint, 100, "%", [i](const auto& s) { return s.nominal_lever[i]; });
  }
  value("valve dead band error, worst edge", 100, "% of stroke", [](const auto& s) { return s.dead_band; });
  value("valve delay error, worst axis", 1e3, "ms", [](const auto& s) { return s.delay_s; });
  value("valve flow error, worst axis", 100, "%", [](const auto& s) { return s.flow; });
  return table.take();
}

}  // namespace

std::vector<BatteryRow> battery_rows(const std::vector<MachineOutcome>& machines, double full_scale_kg) {
  std::vector<std::string> methods;
  for (const MachineOutcome& machine : machines) {
    for (const MethodOutcome& o : machine.methods) {
      if (std::find(methods.begin(), methods.end(), o.method) == methods.end()) methods.push_back(o.method);
    }
  }
  std::vector<BatteryRow> rows = commissioning_rows(machines);
  for (const std::string& method : methods) {
    Outcomes all;
    double usable = 0;
    for (const MachineOutcome& machine : machines) {
      for (const MethodOutcome& o : machine.methods) {
        if (o.method != method) continue;
        usable += o.usable ? 1 : 0;
        if (o.identified) all.push_back(&o);
      }
    }
    Table table(method, method == kFull || method == kFullNominalPins || method == kFullFineEncoders);
    table.at_least("machines with a usable result", share(usable, static_cast<double>(machines.size())), "1", 1);
    if (method != kFullFineEncoders) {
      no_load_rows(all, table);
      press_rows(pulls_of(all), table, method == kFullNominalPins ? 0.88 : 0.97);
      torque_rows(all, table);
      parameter_rows(all, table);
      honesty_rows(all, table);
      payload_rows(all, full_scale_kg, table);
    }
    contact_rows(all, table, method == kFullFineEncoders ? 30 : 36, method == kFullFineEncoders ? 50 : 75);
    const std::vector<BatteryRow> own = table.take();
    rows.insert(rows.end(), own.begin(), own.end());
    if (method != kFull) continue;
    const std::vector<BatteryRow> models = contact_model_rows(method, all);
    rows.insert(rows.end(), models.begin(), models.end());
  }
  return rows;
}

}  // namespace knuckle::studies
