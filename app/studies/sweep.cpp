#include "app/studies/sweep.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/cli/interrupt.h"
#include "app/cli/output_file.h"
#include "app/cli/progress.h"
#include "app/identify/ensemble.h"
#include "app/identify/parallel.h"
#include "app/studies/battery_table.h"
#include "app/studies/error_sources.h"
#include "core/error.h"
#include "machine/load.h"

namespace knuckle::studies {
namespace {

struct SweepOptions {
  std::string battery, machine = "solar015", json;
  int machines = 20, ensemble = 40, ablation = 0, budget = 0, jobs = 0;
  std::uint64_t seed = 1;
};

constexpr std::uint64_t kSeedsApart = 1'000'000'007;  // so that two sweeps share no machine

CLI::Validator count(int low, int high) {
  return {[low, high](const std::string& text) { return cli::count_error(text, low, high); }, "", "count"};
}

void add_options(CLI::App& c, SweepOptions& o) {
  c.add_option("--battery", o.battery, "Battery to run: estimation")->required()->check(CLI::IsMember({"estimation"}));
  c.add_option("--machine", o.machine, "Nominal machine that the machines are sampled around: name or .toml file")
      ->capture_default_str();
  c.add_option("--machines", o.machines, "Number of sampled machines, 1 to 100000")
      ->capture_default_str()
      ->check(count(1, 100'000));
  c.add_option("--seed", o.seed, "Seed of the sampled machines")
      ->capture_default_str()
      ->check(CLI::Validator(cli::seed_error, "", "seed"));
  c.add_option("--ensemble", o.ensemble, "Number of other machines to measure the model error on, 2 to 10000; 0: none")
      ->capture_default_str()
      ->check(CLI::Validator(cli::ensemble_size_error, "", "machines"));
  c.add_option("--ablation", o.ablation,
               "Number of machines to test the method on with each part switched off in turn; 0: none")
      ->capture_default_str()
      ->check(count(0, 100'000));
  c.add_option("--budget", o.budget, "Number of machines for each single source of error; 0: none")
      ->capture_default_str()
      ->check(count(0, 100'000));
  c.add_option("--jobs", o.jobs, "Threads, up to 1024; 0: one per processor")
      ->capture_default_str()
      ->check(count(0, 1024));
  c.add_option("--json", o.json, "Write the rows as JSON (described in docs/estimation-results.md)");
  c.footer(cli::kExitCodes);
}

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

class Sweep {
 public:
  explicit Sweep(const SweepOptions& options) : options_(options) {
    setup_.nominal = load_machine(find_config("machine", options.machine));
    if (setup_.nominal.dynamics_calibration || setup_.nominal.geometry_calibration) {
      throw InputError(setup_.nominal.source +
                       ": table [calibration]: the battery needs a nominal machine file, "
                       "not a calibrated one");
    }
  }

  void run() {
    if (options_.ensemble > 0) {
      setup_.full.model_error = ensemble_error("ensemble", true);
      setup_.full_nominal_pins.model_error = ensemble_error("ensemble, nominal pins", false);
    }
    const auto sampled = [&](std::uint64_t seed) { return sim::sample_truth(setup_.nominal, seed); };
    keep("", judged(setup_, options_.machines, "machines", sampled));
    if (options_.ablation > 0) {
      BatterySetup setup = setup_;
      setup.baselines = false;
      setup.variants = ablation(setup_.full);
      keep("ablation: ", judged(setup, options_.ablation, "ablation", sampled));
    }
    for (std::size_t s = 0; options_.budget > 0 && s < kErrorSourceNames.size(); ++s) {
      BatterySetup setup = setup_;
      setup.baselines = false;
      const auto source = static_cast<ErrorSource>(s);
      const auto truth = [&](std::uint64_t seed) { return with_only(setup_.nominal, sampled(seed), source); };
      setup.oil_changes = source == ErrorSource::kOil;
      keep(std::string("only ") + kErrorSourceNames[s] + ": ",
           judged(setup, options_.budget, kErrorSourceNames[s], truth));
    }
  }

  [[nodiscard]] const std::vector<BatteryRow>& rows() const noexcept { return rows_; }
  [[nodiscard]] const std::vector<std::string>& failures() const noexcept { return failures_; }
  [[nodiscard]] const MachineDescription& nominal() const noexcept { return setup_.nominal; }

 private:
  CalibrationMatrix ensemble_error(const std::string& title, bool surveyed) {
    identify::CommissionPlan plan = setup_.commission;
    if (!surveyed) plan.survey_poses = 0;
    return cli::watched(interrupt_, title, [&](const auto& progress) {
      return identify::model_error(setup_.nominal, plan, surveyed, options_.ensemble, options_.seed * kSeedsApart,
                                   options_.jobs, progress);
    });
  }

  std::vector<MachineOutcome> judged(const BatterySetup& setup, int count, const std::string& title,
                                     const std::function<sim::MachineTruth(std::uint64_t)>& truth) {
    std::vector<MachineOutcome> outcomes(static_cast<std::size_t>(count));
    cli::watched(interrupt_, title, [&](const auto& progress) {
      identify::parallel_for(
          outcomes.size(), options_.jobs,
          [&](std::size_t i) {
            const std::uint64_t seed = options_.seed * kSeedsApart + i;
            outcomes[i] = judge_machine(setup, truth(seed), seed);
          },
          progress);
      return 0;
    });
    return outcomes;
  }

  void keep(const std::string& prefix, const std::vector<MachineOutcome>& outcomes) {
    for (const MachineOutcome& outcome : outcomes) {
      if (!outcome.failure.empty()) {
        failures_.push_back(prefix + "machine " + std::to_string(outcome.seed) + ": " + outcome.failure);
      }
    }
    for (BatteryRow row : battery_rows(outcomes, setup_.nominal.payload_full_scale_kg)) {
      row.method = prefix + row.method;
      if (!prefix.empty()) row.met.reset();
      rows_.push_back(row);
    }
  }

  const cli::InterruptGuard interrupt_;
  SweepOptions options_;
  BatterySetup setup_;
  std::vector<BatteryRow> rows_;
  std::vector<std::string> failures_;
};

nlohmann::ordered_json json_of(const SweepOptions& options, const Sweep& sweep, bool met) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const BatteryRow& row : sweep.rows()) {
    rows.push_back({{"quantity", row.quantity},
                    {"method", row.method},
                    {"value", std::isfinite(row.value) ? nlohmann::ordered_json(row.value) : nlohmann::ordered_json()},
                    {"unit", row.unit},
                    {"target", row.target.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(row.target)},
                    {"met", row.met ? nlohmann::ordered_json(*row.met) : nlohmann::ordered_json()}});
  }
  return {{"schema", "knuckle-sweep/2"},  {"version", cli::program_version()},
          {"battery", options.battery},   {"machine", sweep.nominal().name},
          {"machines", options.machines}, {"ensemble", options.ensemble},
          {"seed", options.seed},         {"passed", met},
          {"failures", sweep.failures()}, {"rows", rows}};
}

void print(std::ostream& out, const Sweep& sweep) {
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

int run_sweep(const SweepOptions& options) {
  cli::Places places;
  places.configuration("--machine", options.machine);
  places.output("--json", options.json);
  std::optional<cli::OutputFile> json;
  if (!options.json.empty()) json.emplace("--json", options.json);
  Sweep sweep(options);
  sweep.run();
  bool met = sweep.failures().empty();
  for (const BatteryRow& row : sweep.rows()) met = met && row.met.value_or(true);
  if (json) {
    json->stream() << json_of(options, sweep, met).dump(2) << '\n';
    json->commit();
  }
  print(cli::is_standard_output(options.json) ? std::cerr : std::cout, sweep);
  return met ? 0 : 1;
}

}  // namespace

cli::Command sweep_entry() {
  return {"sweep", "Evaluate Knuckle on many randomly sampled machines", [](CLI::App& command) {
            const auto options = std::make_shared<SweepOptions>();
            add_options(command, *options);
            return [options] { return run_sweep(*options); };
          }};
}

}  // namespace knuckle::studies
