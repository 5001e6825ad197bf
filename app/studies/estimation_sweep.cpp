#include <fmt/format.h>

#include <array>
#include <cmath>
#include <functional>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "app/cli/command.h"
#include "app/cli/output_file.h"
#include "app/identify/ensemble.h"
#include "app/session/truth_file.h"
#include "app/studies/battery_machine.h"
#include "app/studies/shared_battery.h"
#include "app/studies/sweep.h"
#include "core/error.h"
#include "machine/description.h"
#include "machine/load.h"
#include "sim/truth.h"

namespace knuckle::studies {
namespace {

void take_geometry(const MachineDescription& from, MachineDescription& to) {
  for (std::size_t i = 0; i < kJoints; ++i) to.links[i].length_m = from.links[i].length_m;
  to.boom_mount = from.boom_mount;
  to.arm_mount = from.arm_mount;
  const BucketLinkage masses = to.bucket_linkage;
  to.bucket_linkage = from.bucket_linkage;
  to.bucket_linkage.rocker_mass_kg = masses.rocker_mass_kg;
  to.bucket_linkage.coupler_mass_kg = masses.coupler_mass_kg;
}

void take_masses(const MachineDescription& from, MachineDescription& to) {
  for (std::size_t i = 0; i < kJoints; ++i) {
    to.links[i].mass_kg = from.links[i].mass_kg;
    to.links[i].inertia_kgm2 = from.links[i].inertia_kgm2;
    to.cylinders[i].body_mass_kg = from.cylinders[i].body_mass_kg;
    to.cylinders[i].rod_mass_kg = from.cylinders[i].rod_mass_kg;
  }
  to.bucket_linkage.rocker_mass_kg = from.bucket_linkage.rocker_mass_kg;
  to.bucket_linkage.coupler_mass_kg = from.bucket_linkage.coupler_mass_kg;
}

/// One of a sampled machine's errors, for what it costs: truths that differ from the drawing in one respect alone.
struct ErrorSource {
  const char* name;
  void (*take)(const sim::MachineTruth& sampled, sim::MachineTruth& truth);
  bool oil_changes = false;  ///< Other oil on the day of use.
};
constexpr auto kErrorSources = std::to_array<ErrorSource>({
    // What is left is LuGre against Dahl, cylinder masses, noise, quantisation, lags, hoses.
    {"nothing but noise", [](const sim::MachineTruth&, sim::MachineTruth&) {}},
    {"pins and lengths", [](const auto& sampled, auto& truth) { take_geometry(sampled.machine, truth.machine); }},
    {"masses", [](const auto& sampled, auto& truth) { take_masses(sampled.machine, truth.machine); }},
    {"friction", [](const auto& sampled, auto& truth) { truth.friction = sampled.friction; }},
    {"pressure transmitters", [](const auto& sampled, auto& truth) { truth.pressure = sampled.pressure; }},
    {"hull and slope",
     [](const auto& sampled, auto& truth) {
       truth.hull_pitch_rad = sampled.hull_pitch_rad;
       truth.tilt_offset_rad = sampled.tilt_offset_rad;
     }},
    {"encoders",
     [](const auto& sampled, auto& truth) {
       truth.encoder_offset_m = sampled.encoder_offset_m;
       truth.encoder_noise_m = sampled.encoder_noise_m;
     }},
    {"valves",
     [](const auto& sampled, auto& truth) {
       for (std::size_t i = 0; i < kJoints; ++i) truth.machine.cylinders[i].valve = sampled.machine.cylinders[i].valve;
       truth.machine.hydraulics.bulk_modulus_Pa = sampled.machine.hydraulics.bulk_modulus_Pa;
     }},
    {"oil", [](const auto& sampled, auto& truth) { truth.viscosity_factor = sampled.viscosity_factor; }, true},
});

constexpr std::uint64_t kSeedsApart = 1'000'000'007;  // so that two sweeps share no machine

/// The method with each part switched off in turn.
std::vector<FullVariant> ablation(const estimation::FullOptions& full) {
  std::vector<FullVariant> variants;
  const auto without = [&](const char* what, const std::function<void(estimation::FullOptions&)>& change) {
    variants.push_back({std::string("without ") + what, full});
    change(variants.back().options);
  };
  without("friction", [](auto& o) { o.friction = false; });
  without("Dahl state (sign of speed)", [](auto& o) { o.regressor.friction.dahl = false; });
  without("Stribeck", [](auto& o) { o.regressor.friction.stribeck = false; });
  without("load share", [](auto& o) { o.regressor.friction.load = false; });
  without("weights", [](auto& o) { o.weighted = false; });
  without("Huber", [](auto& o) { o.huber = 0; });
  without("physical consistency", [](auto& o) { o.consistent = false; });
  without("zero-phase triangle", [](auto& o) { o.regressor.triangle_s = 0; });
  without("2 Hz pole (20 Hz)", [](auto& o) { o.regressor.pole_Hz = 20; });
  without("41-sample cubic (7, quadratic)", [](auto& o) {
    o.motion.window_s = 0.035;
    o.motion.order = 2;
  });
  variants.push_back({"with 5 ms of pressure lag taken off", full});
  variants.back().options.motion.pressure_lag_s = 5e-3;
  return variants;
}

/// Machines that are judged alike.
struct Part {
  std::string name;  ///< Leads the methods' names; empty: the battery itself.
  int machines = 0;
  BatterySetup setup;
  std::function<sim::MachineTruth(std::uint64_t seed)> truth;
};

class EstimationBattery {
 public:
  /// @param shows whether progress is shown.
  EstimationBattery(const SweepOptions& options, bool shows)
      : options_(options),
        shows_(shows),
        family_(session::family_named(options.family.value_or(""))),
        nominal_(load_machine(find_config("machine", options.machine.value_or("solar015")))) {
    const double length_m = nominal_.links[kBucket].length_m;
    if (!(options.from_tip_m >= 0 && options.from_tip_m <= length_m)) {
      throw InputError(fmt::format("--contact-from-tip-m: {} must be within [0, {}], the bucket's length",
                                   options.from_tip_m, length_m));
    }
    if (nominal_.dynamics_calibration || nominal_.geometry_calibration) {
      throw InputError(nominal_.source +
                       ": table [calibration]: the battery needs a nominal machine file, "
                       "not a calibrated one");
    }
    add_parts();
  }

  [[nodiscard]] battery::RowsKey key() const {
    return {.settings = {{"battery", options_.battery},
                         {"machine", nominal_.name},
                         {"machines", options_.machines},
                         {"ensemble", options_.ensemble},
                         {"ablation", options_.ablation},
                         {"budget", options_.budget},
                         {"running", options_.running},
                         {"family", sim::name(family_)},
                         {"seed", seed()},
                         {"contact_from_tip_m", options_.from_tip_m}},
            .fingerprint = battery::fingerprint({nominal_.source}),
            .cells = cells(),
            .is_row = [this](const battery::Row& row) { return is_row(row); }};
  }

  /// What every machine is judged with: the model error of other ones. The same in every process.
  void measure_model_error() {
    if (options_.ensemble == 0) return;
    const CalibrationMatrix surveyed = ensemble_error("ensemble", true);
    const CalibrationMatrix unsurveyed = ensemble_error("ensemble, nominal pins", false);
    for (Part& part : parts_) {
      part.setup.full.model_error = surveyed;
      part.setup.full_nominal_pins.model_error = unsurveyed;
      if (part.name == kAblation) part.setup.variants = ablation(part.setup.full);
    }
  }

  [[nodiscard]] battery::Row run(std::uint64_t cell) const {
    const auto [part, machine] = place_of(cell);
    const std::uint64_t own = own_seed(machine);
    battery::Row row;
    row["cell"] = cell;
    row.update(judge_machine(part->setup, part->truth(own), own));
    return row;
  }

  /// Of the machines that are there: the table, and what went wrong.
  void judge(const battery::Rows& rows) {
    std::uint64_t first = 0;
    for (const Part& part : parts_) {
      std::vector<battery::Row> machines;
      const std::uint64_t end = first + static_cast<std::uint64_t>(part.machines);
      for (auto row = rows.lower_bound(first); row != rows.end() && row->first < end; ++row)
        machines.push_back(row->second);
      keep(part.name, machines);
      first = end;
    }
  }

  [[nodiscard]] std::uint64_t cells() const noexcept {
    std::uint64_t sum = 0;
    for (const Part& part : parts_) sum += static_cast<std::uint64_t>(part.machines);
    return sum;
  }
  [[nodiscard]] const std::vector<BatteryRow>& rows() const noexcept { return rows_; }
  [[nodiscard]] const std::vector<std::string>& failures() const noexcept { return failures_; }
  [[nodiscard]] std::uint64_t seed() const noexcept { return options_.seed.value_or(1); }
  [[nodiscard]] sim::Family family() const noexcept { return family_; }
  [[nodiscard]] const MachineDescription& nominal() const noexcept { return nominal_; }

 private:
  static constexpr const char* kAblation = "ablation: ";

  void add_parts() {
    BatterySetup setup;
    setup.nominal = nominal_;
    setup.family = family_;
    setup.trials.from_tip_m = options_.from_tip_m;
    identify::set_surveyor(family_, setup.commission);
    const auto sampled = [this](std::uint64_t seed) { return sim::sample_truth(nominal_, family_, seed); };
    parts_.push_back({"", options_.machines, setup, sampled});
    setup.baselines = false;
    if (options_.running > 0) {
      parts_.push_back({"running: ", options_.running, setup, sampled});
      parts_.back().setup.running.emplace();
    }
    if (options_.ablation > 0) {
      parts_.push_back({kAblation, options_.ablation, setup, sampled});
      parts_.back().setup.variants = ablation(setup.full);
    }
    if (options_.budget == 0) return;
    for (const ErrorSource& source : kErrorSources) {
      setup.oil_changes = source.oil_changes;
      parts_.push_back(
          {std::string("only ") + source.name + ": ", options_.budget, setup, [=, this](std::uint64_t seed) {
             sim::MachineTruth truth = sim::nominal_truth(nominal_);
             source.take(sampled(seed), truth);
             return truth;
           }});
    }
  }

  [[nodiscard]] bool is_row(const battery::Row& row) const {
    return is_judged_machine(row) && row["seed"] == own_seed(place_of(row["cell"].get<std::uint64_t>()).second);
  }

  [[nodiscard]] std::uint64_t own_seed(std::uint64_t machine) const noexcept { return seed() * kSeedsApart + machine; }

  /// The part that a cell belongs to, and which of its machines it is.
  [[nodiscard]] std::pair<const Part*, std::uint64_t> place_of(std::uint64_t cell) const {
    auto part = parts_.begin();
    for (; cell >= static_cast<std::uint64_t>(part->machines); ++part)
      cell -= static_cast<std::uint64_t>(part->machines);
    return {&*part, cell};
  }

  CalibrationMatrix ensemble_error(const std::string& title, bool surveyed) const {
    identify::CommissionPlan plan = parts_.front().setup.commission;
    if (!surveyed) plan.survey_poses = 0;
    return watched_where(shows_, title, [&](const std::function<void(double)>& progress) {
      return identify::model_error(nominal_, plan, surveyed, options_.ensemble, seed() * kSeedsApart, options_.jobs,
                                   progress);
    });
  }

  void keep(const std::string& prefix, const std::vector<battery::Row>& machines) {
    if (machines.empty()) return;
    for (const battery::Row& machine : machines) {
      if (machine.contains("failure"))
        failures_.push_back(fmt::format("{}machine {}: {}", prefix, machine["seed"].get<std::uint64_t>(),
                                        machine["failure"].get<std::string>()));
    }
    for (BatteryRow row : battery_rows(machines, nominal_.payload_full_scale_kg)) {
      row.method = prefix + row.method;
      if (!prefix.empty()) row.met.reset();
      rows_.push_back(row);
    }
  }

  SweepOptions options_;
  bool shows_;
  sim::Family family_;
  MachineDescription nominal_;
  std::vector<Part> parts_;
  std::vector<BatteryRow> rows_;
  std::vector<std::string> failures_;
};

nlohmann::ordered_json json_of(const SweepOptions& options, const EstimationBattery& sweep, std::size_t judged,
                               bool met) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const BatteryRow& row : sweep.rows()) {
    rows.push_back({{"quantity", row.quantity},
                    {"method", row.method},
                    {"value", std::isfinite(row.value) ? nlohmann::ordered_json(row.value) : nlohmann::ordered_json()},
                    {"unit", row.unit},
                    {"target", row.target.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(row.target)},
                    {"met", row.met ? nlohmann::ordered_json(*row.met) : nlohmann::ordered_json()}});
  }
  return {{"schema", "knuckle-sweep/2"},
          {"version", cli::program_version()},
          {"battery", options.battery},
          {"machine", sweep.nominal().name},
          {"machines", options.machines},
          {"ensemble", options.ensemble},
          {"ablation", options.ablation},
          {"budget", options.budget},
          {"running", options.running},
          {"family", sim::name(sweep.family())},
          {"seed", sweep.seed()},
          {"contact_from_tip_m", options.from_tip_m},
          {"cells", sweep.cells()},
          {"judged", judged},
          {"passed", judged == sweep.cells() ? nlohmann::ordered_json(met) : nlohmann::ordered_json()},
          {"failures", sweep.failures()},
          {"rows", rows}};
}

void print(std::ostream& out, const EstimationBattery& sweep) {
  for (const std::string& failure : sweep.failures()) out << "failed: " << failure << '\n';
  std::string method;
  for (const BatteryRow& row : sweep.rows()) {
    if (row.method != method) out << '\n' << row.method << '\n';
    method = row.method;
    const char* verdict = !row.met ? "      " : *row.met ? "met   " : "MISSED";
    out << "  " << verdict << ' ' << row.quantity << ": " << row.value << ' ' << (row.unit == "1" ? "" : row.unit);
    if (!row.target.empty()) out << "  (" << row.target << ')';
    out << '\n';
  }
}

int finish(const SweepOptions& options, EstimationBattery& sweep, cli::OptionalOutput& json,
           const battery::Rows& rows) {
  sweep.judge(rows);
  const bool whole = rows.size() == sweep.cells();
  bool met = whole && sweep.failures().empty();
  for (const BatteryRow& row : sweep.rows()) met = met && row.met.value_or(true);
  json.write([&](std::ostream& to) { to << json_of(options, sweep, rows.size(), met).dump(2) << '\n'; });
  std::ostream& out = cli::is_standard_output(options.json) ? std::cerr : std::cout;
  if (!whole)
    out << fmt::format("{} of {} machines: no verdict until --merge has them all\n", rows.size(), sweep.cells());
  print(out, sweep);
  return met || !whole ? 0 : 1;
}

}  // namespace

int run_estimation_sweep(const SweepOptions& options) {
  return run_shared(options, [&options](bool writes) {
    const auto json = std::make_shared<cli::OptionalOutput>("--json", writes ? options.json : "");
    const auto sweep = std::make_shared<EstimationBattery>(options, writes);
    return SharedBattery{
        .title = options.battery,
        .key = sweep->key(),
        .prepare = [sweep] { sweep->measure_model_error(); },
        .run = [sweep](std::uint64_t cell) { return sweep->run(cell); },
        .finish = [=, &options](const battery::Rows& rows) { return finish(options, *sweep, *json, rows); }};
  });
}

}  // namespace knuckle::studies
