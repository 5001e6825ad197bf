#include "app/commissioning/identify_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <utility>

#include "app/csv_mapping.h"

namespace knuckle::app {
namespace {

const std::vector<std::string> kMethods{"full", "static", "malaguti", "kim"};
constexpr double kShortest_s = 20, kLongest_s = 1200;

struct Given {
  IdentifyOptions options;
  std::vector<std::string> hold_out;  // a share or files
};

void add_options(CLI::App& c, Given& given) {
  IdentifyOptions& o = given.options;
  c.add_option("recordings", o.recordings, "CSV files of sensor signals: Knuckle's own, or any with --map");
  c.add_option("--map", o.map, "Mapping file (.toml) that says how to read them");
  c.add_option("--machine", o.machine, "Machine name or .toml file: its drawing")->capture_default_str();
  c.add_option("--method", o.method, "full, static, malaguti or kim")->capture_default_str();
  c.add_option("--hold-out", given.hold_out, "Validate on this share of each recording's end (0.25), or on these files")
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->expected(1, 20);
  c.add_option("--survey", o.survey, "Surveyed poses (.csv): calibrates lengths and pins first");
  c.add_option("--survey-sigma-mm", o.survey_sigma_mm, "Standard deviation of a surveyed coordinate")
      ->capture_default_str();
  c.add_flag("--simulate", o.simulate, "Commission the simulated machine: survey, excite, record, identify, validate");
  c.add_option("--seed", o.seed, "Draws the simulated machine's truth")
      ->capture_default_str()
      ->check(CLI::Validator(seed_error, "", "seed"));
  c.add_option("--slow", o.slow_s, "Seconds of slow sweeps to drive")->capture_default_str();
  c.add_option("--fast", o.fast_s, "Seconds of fast motion to drive")->capture_default_str();
  c.add_option("--ensemble", o.ensemble,
               "Simulated machines of the same drawing, commissioned alike, that the model's own error is measured on; "
               "0: standard deviations without it")
      ->capture_default_str();
  c.add_option("--record", o.record, "Keep the recordings and the survey as CSV in this folder");
  c.add_option("--out", o.out, "Write the calibrated machine file; one that is there is kept under a number");
  c.add_option("--report", o.report, "Write a self-contained HTML report");
  c.add_option("--json", o.json, "Write the result (docs/identification.md says what is in it)");
}

void sort_hold_out(Given& given) {
  IdentifyOptions& o = given.options;
  for (const std::string& value : given.hold_out) {
    const double share = number_in(value);
    if (std::isfinite(share) && given.hold_out.size() == 1) {
      check_range("--hold-out", share, 0.05, 0.6, "");
      o.hold_out_share = share;
    } else {
      check_readable("--hold-out", value);
      o.hold_out_files.push_back(value);
    }
  }
}

void check_simulated(const IdentifyOptions& o) {
  if (!o.recordings.empty()) refuse_option("--simulate", "", "makes its own recordings; give none");
  if (!o.hold_out_files.empty()) refuse_option("--hold-out", o.hold_out_files.front(), "--simulate drives its own");
  if (!o.map.empty()) refuse_option("--map", o.map, "only goes with recordings");
  if (!o.survey.empty()) refuse_option("--survey", o.survey, "--simulate surveys by itself");
}

void check(const IdentifyOptions& o) {
  if (std::find(kMethods.begin(), kMethods.end(), o.method) == kMethods.end())
    refuse_option("--method", o.method, "must be full, static, malaguti or kim");
  if (o.method != "full" && !o.out.empty())
    refuse_option("--out", o.out, "only --method full knows all that a calibrated machine file needs");
  check_range("--slow", o.slow_s, kShortest_s, kLongest_s, " s");
  check_range("--fast", o.fast_s, kShortest_s, kLongest_s, " s");
  if (o.ensemble != 0) check_range("--ensemble", o.ensemble, 2, 10'000, " machines");
  if (o.ensemble != 0 && o.method != "full")
    refuse_option("--ensemble", std::to_string(o.ensemble), "only goes with --method full");
  check_range("--survey-sigma-mm", o.survey_sigma_mm, 0.01, 100, " mm");
  if (o.simulate) {
    check_simulated(o);
  } else {
    if (o.recordings.empty()) refuse_option("identify", "", "needs recordings (.csv), or --simulate");
    if (!o.record.empty()) refuse_option("--record", o.record, "only goes with --simulate");
  }
  for (const std::string& file : o.recordings) check_readable("identify", file);
  if (!o.map.empty()) check_readable("--map", o.map);
  if (!o.survey.empty()) check_readable("--survey", o.survey);
  Places places;
  for (const std::string& file : o.recordings) places.input("identify", file);
  for (const std::string& file : o.hold_out_files) places.input("--hold-out", file);
  places.input("--map", o.map);
  places.input("--survey", o.survey);
  places.output("--report", o.report);
  places.output("--json", o.json);
  places.output("--out", o.out);
}

}  // namespace

Command identify_entry(std::function<int(const IdentifyOptions&)> run) {
  return {"identify", "Find out a machine's parameters from recordings; write a calibrated machine file",
          [run = std::move(run)](CLI::App& command) {
            const auto given = std::make_shared<Given>();
            add_options(command, *given);
            return [given, run] {
              sort_hold_out(*given);
              check(given->options);
              return run(given->options);
            };
          }};
}

}  // namespace knuckle::app
