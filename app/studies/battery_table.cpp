
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "app/battery/quantity.h"
#include "app/studies/battery_machine.h"
#include "estimation/line_of_action.h"
#include "machine/contact_model.h"

namespace knuckle::studies {
namespace {

using battery::By;
using battery::kNever;
using battery::Quantity;
using battery::Sources;

constexpr double kTenMinutes_s = 600;

using Quantities = std::vector<Quantity>;

Quantity within(double low, double high, Quantity quantity) {
  quantity.low = low;
  quantity.high = high;
  return quantity;
}
Quantity at_most(double bound, Quantity quantity) {
  return within(-kNever, bound, std::move(quantity));
}
Quantity asked(Quantity quantity) {
  quantity.asked = true;
  return quantity;
}

void add_rows(const std::string& method, bool judged, const Quantities& quantities, const Sources& sources,
              std::vector<BatteryRow>& rows) {
  for (const Quantity& quantity : quantities) {
    BatteryRow row{quantity.name, method, value_of(quantity, sources), quantity.unit, "", std::nullopt};
    if (judged) row.target = quantity.target();
    if (std::isnan(row.value) && (row.target.empty() || !quantity.asked)) continue;
    if (!row.target.empty()) row.met = row.value >= quantity.low && row.value <= quantity.high;
    rows.push_back(row);
  }
}

Quantities no_load() {
  return {
      asked(at_most(30, {"no-load tip force, slow, RMS, median of machines", "slow_rms_N", By::kMedian, "N"})),
      asked(at_most(45, {"no-load tip force, slow, RMS, p95 of machines", "slow_rms_N", By::kP95, "N"})),
      asked(at_most(90, {"no-load tip force, slow, 95 % of its size, p95 of machines", "slow_p95_N", By::kP95, "N"})),
      {"no-load tip force, slow, 95 % of its size, worst machine", "slow_p95_N", By::kWorst, "N"},
      asked(at_most(45,
                    {"no-load tip force, digging speed, RMS, median of machines", "digging_rms_N", By::kMedian, "N"})),
      asked(at_most(60, {"no-load tip force, digging speed, RMS, p95 of machines", "digging_rms_N", By::kP95, "N"}))};
}

/// @param least share of good ones that is the target; 0: of another contact model, which has none.
Quantities presses(double least) {
  Quantities all;
  for (const std::string which : {"standing", "creeping"}) {
    const std::string pull = "known force 1-5 kN", end = ", " + which, at = "." + which;
    all.push_back(asked(
        within(least, kNever, {pull + " within max(3 %, 60 N) and 3 deg" + end, "press_good" + at, By::kShare, "1"})));
    all.push_back({pull + ", error, median" + end, "press_error_N" + at, By::kMedian, "N"});
    all.push_back({pull + ", error, p95" + end, "press_error_N" + at, By::kP95, "N"});
    if (least > 0)
      all.push_back({pull + ", a tenth or more of it reported as load" + end, "press_as_load" + at, By::kShare, "1"});
  }
  return all;
}

Quantities contact_model() {
  Quantities all{{"known force 1-5 kN, answered", "answered", By::kShare, "1"}};
  const Quantities of_presses = presses(0);
  all.insert(all.end(), of_presses.begin(), of_presses.end());
  all.push_back({"false torque about the tip, p95", "torque_Nm", By::kP95, "N m"});
  all.push_back({"position along the bucket, error, median", "place_error_m", By::kMedian, "mm", 1e3});
  all.push_back({"position along the bucket, error, p95", "place_error_m", By::kP95, "mm", 1e3});
  return all;
}

Quantities torque() {
  constexpr std::array<double, kJoints> kMost{2.5, 2.5, 3};
  Quantities all;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const std::string joint = kJointNames[i], smooth = "held-out torque NRMSE to 2 Hz, " + joint;
    all.push_back(asked(at_most(kMost[i], {smooth + ", median", "torque_2Hz." + joint, By::kMedian, "%", 100})));
    all.push_back(asked(at_most(5, {smooth + ", p95", "torque_2Hz." + joint, By::kP95, "%", 100})));
    all.push_back(
        {"held-out torque NRMSE unfiltered, " + joint + ", median", "torque_raw." + joint, By::kMedian, "%", 100});
  }
  return all;
}

Quantities parameters() {
  constexpr std::array<double, kJoints> kGravity{2, 2, 4}, kInertia{6, kNever, kNever};
  Quantities all;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const std::string joint = kJointNames[i], error = "gravity moment error, " + joint;
    all.push_back(at_most(kGravity[i], {error + ", median", "gravity." + joint, By::kMedian, "%", 100}));
    all.push_back({error + ", p95", "gravity." + joint, By::kP95, "%", 100});
  }
  for (std::size_t i = 0; i < kJoints; ++i) {
    const std::string joint = kJointNames[i];
    all.push_back(
        at_most(kInertia[i], {"inertia error, " + joint + ", median", "inertia." + joint, By::kMedian, "%", 100}));
  }
  for (const std::string joint : kJointNames)
    all.push_back(
        at_most(3, {"friction curve F_f(v) error, " + joint + ", median", "friction." + joint, By::kMedian, "%", 100}));
  all.push_back(
      within(0.9, 0.99,
             {"95 % intervals of base parameters that contain the true value", "parameters_covered", By::kRatio, "1"}));
  return all;
}

Quantities honesty() {
  return {
      within(0.9, 0.99,
             {"95 % ellipse of the tip force contains the true force, free motion", "free_covered", By::kRatio, "1"}),
      within(0.9, 0.99,
             {"95 % ellipse of the tip force contains the true force, known forces", "press_covered", By::kShare, "1"}),
      {"NIS of the bias filter, mean per degree of freedom", "nis", By::kMedian, "1"}};
}

Quantities payload(double full_scale_kg) {
  Quantities all{at_most(1, {"payload error, 2 sigma, of full scale, zeroed", "payload_error_kg", By::kRms, "%", 200}),
                 {"payload 95 % interval contains the true load", "payload_covered", By::kShare, "1"}};
  all[0].whole = full_scale_kg;
  return all;
}

Quantities contact(double median_ms, double p95_ms) {
  Quantities all{
      at_most(median_ms, {"500 N step seen after, median", "detection_s", By::kMedian, "ms", 1e3}),
      at_most(p95_ms, {"500 N step seen after, p95", "detection_s", By::kP95, "ms", 1e3}),
      at_most(1, {"false contact alarms in 10 min of free motion", "false_alarms", By::kRatio, "1", kTenMinutes_s})};
  all[0].missing = all[1].missing = kNever;
  return all;
}

Quantities commissioning() {
  Quantities all;
  const auto add = [&all](const std::string& name, const std::string& metric, double scale, const std::string& unit) {
    all.push_back({name + ", median", metric, By::kMedian, unit, scale});
    all.push_back({name + ", p95", metric, By::kP95, unit, scale});
  };
  add("held-out tip error, surveyed", "tip_median_m", 1e3, "mm");
  add("held-out tip error, nominal", "nominal_tip_median_m", 1e3, "mm");
  for (const std::string joint : kJointNames) {
    add("lever error, surveyed, " + joint, "lever." + joint, 100, "%");
    add("lever error, nominal, " + joint, "nominal_lever." + joint, 100, "%");
  }
  add("valve dead band error, worst edge", "dead_band", 100, "% of stroke");
  add("valve delay error, worst axis", "delay_s", 1e3, "ms");
  add("valve flow error, worst axis", "flow", 100, "%");
  return all;
}

Quantities covered(const std::string& what, const std::string& metric_name, By by = By::kShare) {
  return {within(0.9, 0.99, {what, metric_name, by, "1"})};
}

/// Of what a line of action is told by: torque about the tip and offset from it.
Quantities line_of_action(const std::string& key, const std::string& at) {
  Quantities all = covered("95 % interval of the torque about the tip contains it" + at, key + "_torque_covered");
  const std::string offset = "offset of the line of action, error" + at;
  all.push_back(at_most(3, {offset + ", median", key + "_offset_m", By::kMedian, "cm", 100}));
  all.push_back(at_most(8, {offset + ", p95", key + "_offset_m", By::kP95, "cm", 100}));
  all.push_back(covered("95 % interval of the offset contains it" + at, key + "_offset_covered").front());
  return all;
}

/// Of a contact model in the running machine's side.
Quantities running() {
  Quantities all{{"known force 1-5 kN, answered", "answered", By::kShare, "1"}};
  const auto add = [&all](const Quantities& more) { all.insert(all.end(), more.begin(), more.end()); };
  add(presses(0));
  add(covered("95 % ellipse of the tip force contains the true force, free motion", "free_covered", By::kRatio));
  add(covered("95 % ellipse of the tip force contains the true force, known forces", "press_covered"));
  add({{"false contact alarms in 10 min of free motion", "false_alarms", By::kRatio, "1", kTenMinutes_s},
       at_most(40, {"false torque about the tip, free motion, p95", "free_torque_Nm", By::kP95, "N m"})});
  add(covered("95 % interval of the torque about the tip contains it, free motion", "free_torque_covered", By::kRatio));
  const std::string tip = ", forces at the tip", sides = ", pushes on the sides";
  add({at_most(40, {"false torque about the tip" + tip + ", p95", "tip_torque_error_Nm", By::kP95, "N m"})});
  add(line_of_action("tip", tip));
  add({{"error of the force" + sides + ", median", "beside_error_N", By::kMedian, "N"},
       {"error of the force" + sides + ", p95", "beside_error_N", By::kP95, "N"}});
  add(covered("95 % ellipse of the tip force contains the true force" + sides, "beside_covered"));
  add({{"error of the torque about the tip" + sides + ", median", "beside_torque_error_Nm", By::kMedian, "N m"},
       {"error of the torque about the tip" + sides + ", p95", "beside_torque_error_Nm", By::kP95, "N m"},
       within(0.95, kNever,
              {"torque about the tip within 40 N m or 15 %" + sides, "beside_torque_good", By::kShare, "1"})});
  add(line_of_action("beside", sides));
  const std::string right = "side pushed on has more than half of the probability";
  add({within(0.9, kNever, {right, "side_right", By::kShare, "1"})});
  for (const std::string side : estimation::kBucketSideNames)
    add({{right + ", " + side, "side_right." + side, By::kShare, "1"}});
  return all;
}

Quantities quantities_of(const std::string& method, double full_scale_kg) {
  if (contact_model_named(method)) return running();
  if (method == kFullFineEncoders) return contact(30, 50);
  Quantities all = no_load();
  for (const Quantities& part : {presses(method == kFullNominalPins ? 0.88 : 0.97), torque(), parameters(), honesty(),
                                 payload(full_scale_kg), contact(36, 75)})
    all.insert(all.end(), part.begin(), part.end());
  return all;
}

/// A method on all machines that have it.
struct Method {
  std::string name;
  double usable = 0;
  Sources metrics;  ///< Of those on which it was identified.
};

std::vector<Method> methods_of(const std::vector<Row>& machines) {
  std::vector<Method> methods;
  for (const Row& machine : machines) {
    if (!machine.contains("methods")) continue;
    for (const Row& own : machine["methods"]) {
      const std::string name = own["method"].get<std::string>();
      auto method = std::find_if(methods.begin(), methods.end(), [&](const Method& m) { return m.name == name; });
      if (method == methods.end()) method = methods.insert(methods.end(), {name, 0, {}});
      method->usable += own["usable"].get<bool>() ? 1 : 0;
      if (own["identified"].get<bool>()) method->metrics.push_back(&own["metrics"]);
    }
  }
  return methods;
}

/// The other contact models with the same calibration; stated, as no target asks for them.
void add_contact_models(const Method& method, std::vector<BatteryRow>& rows) {
  if (method.metrics.empty() || !method.metrics.front()->contains("contact_models")) return;
  for (const auto& [model, unused] : (*method.metrics.front())["contact_models"].items()) {
    Sources sources;
    for (const Row* metrics : method.metrics) {
      const auto models = metrics->find("contact_models");
      if (models != metrics->end() && models->contains(model)) sources.push_back(&(*models)[model]);
    }
    add_rows(method.name + ", " + model, false, contact_model(), sources, rows);
  }
}

}  // namespace

std::vector<BatteryRow> battery_rows(const std::vector<Row>& machines, double full_scale_kg) {
  std::vector<BatteryRow> rows;
  Sources commissioned;
  for (const Row& machine : machines) {
    if (machine.contains("commissioning")) commissioned.push_back(&machine["commissioning"]);
  }
  add_rows("commissioning", false, commissioning(), commissioned, rows);
  for (const Method& method : methods_of(machines)) {
    const bool judged = contact_model_named(method.name).has_value() || method.name == kFull ||
                        method.name == kFullNominalPins || method.name == kFullFineEncoders;
    const double share = method.usable / static_cast<double>(machines.size());
    rows.push_back({"machines with a usable result", method.name, share, "1", "", std::nullopt});
    if (judged) {
      rows.back().target = ">= 1";
      rows.back().met = share >= 1;
    }
    add_rows(method.name, judged, quantities_of(method.name, full_scale_kg), method.metrics, rows);
    if (method.name == kFull) add_contact_models(method, rows);
  }
  return rows;
}

}  // namespace knuckle::studies
