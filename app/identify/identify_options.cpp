#include "app/identify/identify_options.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <set>
#include <utility>

#include "app/cli/output_file.h"
#include "app/identify/baseline_report.h"
#include "app/recordings/csv_mapping.h"
#include "app/session/truth_file.h"

namespace knuckle::identify {
namespace {
namespace fs = std::filesystem;

constexpr double kShortest_s = 20, kLongest_s = 1200;

struct Given {
  IdentifyOptions options;
  std::vector<std::string> hold_out;  // a share or files
};

void add_options(const cli::OptionList& c, Given& given) {
  IdentifyOptions& o = given.options;
  c.add_option("recordings", o.recordings,
               "Recordings (.mcap), or CSV files of sensor signals: Knuckle's own, or any with --map");
  c.add_option("--map", o.map, "Mapping file (.toml) that says how to read them");
  c.add_option("--machine", o.machine, "Machine name or .toml file: its drawing").show_default();
  c.add_option("--method", o.method, "full, static, malaguti or kim").show_default();
  c.add_option("--hold-out", given.hold_out,
               "Validate on this share of each recording's end, 0.05 to 0.6 (default: 0.25), or on these files");
  c.add_option("--survey", o.survey, "Surveyed poses (.csv): calibrates lengths and pins first");
  c.add_option("--survey-sigma-mm", o.survey_sigma_mm, "Standard deviation of a surveyed coordinate").show_default();
  c.add_flag("--simulate", o.simulate, "Commission the simulated machine: survey, excite, record, identify, validate");
  c.add_option("--seed", o.seed, "Random seed of the simulated machine's true parameters, and of an ensemble's")
      .show_default()
      .check(cli::seed_error);
  c.add_option("--family", o.family, "Machines that the seed samples from: smooth (default), serviced or worn");
  c.add_option("--truth", o.truth, "The simulated machine's true parameters (.toml), instead of sampling them");
  c.add_option("--slow", o.slow_s, "Seconds of slow sweeps to drive, 20 to 1200; with --simulate or --ensemble")
      .show_default();
  c.add_option("--fast", o.fast_s, "Seconds of fast motion to drive; with --simulate or --ensemble").show_default();
  c.add_option("--ensemble", o.ensemble,
               "Number of simulated machines of the same drawing on which the model's own error is measured: 2 to "
               "10000; 0: usual errors of sensors, lengths and the friction law are taken instead")
      .show_default()
      .check(cli::ensemble_size_error);
  c.add_option("--record", o.record,
               "Write the simulated recordings and survey into this folder, which must not contain .csv files");
  c.add_option("--out", o.out, "Write the calibrated machine file; an existing one is kept, with a number in its name");
  c.add_option("--report", o.report, "Write a self-contained HTML report");
  c.add_option("--json", o.json, "Write the result as JSON (described in docs/identification.md)");
}

void sort_hold_out(Given& given) {
  IdentifyOptions& o = given.options;
  for (const std::string& value : given.hold_out) {
    const double share = recordings::number_in(value);
    if (std::isfinite(share) && given.hold_out.size() == 1) {
      cli::check_range("--hold-out", share, 0.05, 0.6, "");
      o.hold_out_share = share;
      continue;
    }
    if (std::isfinite(share))
      cli::refuse_option("--hold-out", value, "a share is given once, and not together with files");
    if (!fs::exists(value))
      cli::refuse_option("--hold-out", value, "no such file, nor is it a number from 0.05 to 0.6");
    cli::check_readable("--hold-out", value);
    o.hold_out_files.push_back(value);
  }
}

/// An option that would change nothing is a misunderstanding.
void check_effect(const IdentifyOptions& o, const cli::OptionList& command) {
  for (const char* option : {"--seed", "--slow", "--fast"}) {
    if (command.given(option) && !o.simulate && o.ensemble == 0)
      cli::refuse_option(option, "", "only goes with --simulate or --ensemble");
  }
  for (const char* option : {"--slow", "--fast"}) {
    if (command.given(option) && o.method != "full")
      cli::refuse_option(option, "", "only goes with --method full: the papers' motions have their own lengths");
  }
  if (command.given("--survey-sigma-mm") && !o.simulate && o.survey.empty())
    cli::refuse_option("--survey-sigma-mm", "", "only goes with --survey or --simulate");
}

void check_simulated(const Given& given) {
  const IdentifyOptions& o = given.options;
  if (!o.recordings.empty())
    cli::refuse_option("--simulate", "", "makes its own recordings; " + o.recordings.front() + " is one too many");
  if (!given.hold_out.empty()) cli::refuse_option("--hold-out", given.hold_out.front(), "--simulate drives its own");
  if (!o.map.empty()) cli::refuse_option("--map", o.map, "only goes with recordings");
  if (!o.survey.empty()) cli::refuse_option("--survey", o.survey, "--simulate surveys by itself");
}

/// The folder can be made and written to, and no recording is lost.
void check_record(const std::string& record) {
  if (record.empty()) return;
  const fs::path there = record;
  std::error_code error;
  if (fs::is_directory(there, error)) {
    std::set<std::string> recordings;
    for (const fs::directory_entry& entry : fs::directory_iterator(there, error)) {
      if (entry.path().extension() == ".csv") recordings.insert(entry.path().filename().string());
    }
    if (!recordings.empty()) {
      cli::refuse_option("--record", record,
                         "has " + *recordings.begin() + " already; give a new folder, or one without .csv files");
    }
  }
  cli::check_folder("--record", record);
}

void check_inputs(const IdentifyOptions& o) {
  std::set<fs::path> seen;
  for (const std::string& file : o.recordings) {
    cli::check_readable("recording", file);
    if (!seen.insert(fs::canonical(file)).second) cli::refuse_option("recording", file, "is given twice");
  }
  for (const std::string& file : o.hold_out_files) {
    if (!seen.insert(fs::canonical(file)).second)
      cli::refuse_option("--hold-out", file, "is given twice; validation needs data not used for identification");
  }
  if (!o.map.empty()) cli::check_readable("--map", o.map);
  if (!o.survey.empty()) cli::check_readable("--survey", o.survey);
  if (!o.truth.empty()) cli::check_readable("--truth", o.truth);
}

/// The recordings get names of their own in there.
void check_beside_recordings(const IdentifyOptions& o) {
  if (o.record.empty()) return;
  const fs::path folder = fs::weakly_canonical(o.record);
  for (const auto& [option, file] : {std::pair{"--out", &o.out}, {"--report", &o.report}, {"--json", &o.json}}) {
    if (!file->empty() && !cli::is_standard_output(*file) && fs::weakly_canonical(*file).parent_path() == folder)
      cli::refuse_option(option, *file, "lies in the folder of --record, which is for the recordings alone");
  }
}

void check_places(const IdentifyOptions& o) {
  check_beside_recordings(o);
  cli::Places places;
  for (const std::string& file : o.recordings) places.input("the recordings", file);
  for (const std::string& file : o.hold_out_files) places.input("--hold-out", file);
  places.input("--map", o.map);
  places.input("--survey", o.survey);
  places.input("--truth", o.truth);
  places.configuration_output("--out", o.out);  // may replace the drawing, which is kept
  places.configuration("--machine", o.machine);
  places.output("--report", o.report);
  places.output("--json", o.json);
}

void check(const Given& given, const cli::OptionList& command) {
  const IdentifyOptions& o = given.options;
  if (o.method != "full" && !paper_named(o.method))
    cli::refuse_option("--method", o.method, "must be full, static, malaguti or kim");
  if (o.method != "full" && !o.out.empty())
    cli::refuse_option("--out", o.out, "only --method full identifies all that a calibrated machine file needs");
  cli::check_range("--slow", o.slow_s, kShortest_s, kLongest_s, " s");
  cli::check_range("--fast", o.fast_s, kShortest_s, kLongest_s, " s");
  if (o.ensemble != 0 && o.method != "full")
    cli::refuse_option("--ensemble", std::to_string(o.ensemble), "only goes with --method full");
  cli::check_range("--survey-sigma-mm", o.survey_sigma_mm, 0.01, 100, " mm");
  check_effect(o, command);
  (void)session::family_named(o.family);
  if (!o.truth.empty() && !o.family.empty()) cli::refuse_option("--family", o.family, "does not go with --truth");
  if (o.simulate) {
    check_simulated(given);
  } else {
    if (o.recordings.empty() && !given.hold_out.empty())
      cli::refuse_option("identify", "", "needs recordings (.mcap or .csv), named before --hold-out, or --simulate");
    if (o.recordings.empty()) cli::refuse_option("identify", "", "needs recordings (.mcap or .csv), or --simulate");
    if (!o.record.empty()) cli::refuse_option("--record", o.record, "only goes with --simulate");
    if (!o.family.empty()) cli::refuse_option("--family", o.family, "only goes with --simulate");
    if (!o.truth.empty()) cli::refuse_option("--truth", o.truth, "only goes with --simulate");
  }
  check_inputs(o);
  check_places(o);
  check_record(o.record);
}

}  // namespace

cli::Command identify_entry(std::function<int(const IdentifyOptions&)> run) {
  return {"identify", "Identify a machine's parameters from recordings; write a calibrated machine file",
          [run = std::move(run)](const cli::OptionList& command) {
            const auto given = std::make_shared<Given>();
            add_options(command, *given);
            return [given, command, run] {
              sort_hold_out(*given);
              check(*given, command);
              return run(given->options);
            };
          }};
}

}  // namespace knuckle::identify
