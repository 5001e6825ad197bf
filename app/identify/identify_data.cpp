#include "app/identify/identify_data.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "app/cli/digest.h"
#include "app/cli/output_file.h"
#include "app/identify/baseline_runs.h"
#include "app/identify/data_check.h"
#include "app/identify/shared_samples.h"
#include "app/identify/survey_file.h"
#include "app/recordings/csv_cells.h"
#include "app/recordings/recording_reader.h"
#include "app/session/truth_file.h"
#include "core/error.h"
#include "estimation/identification/excitation.h"
#include "machine/load.h"
#include "machine/pose.h"
#include "machine/whole_file.h"

namespace knuckle::identify {
namespace {
namespace fs = std::filesystem;

using estimation::Recording;
using estimation::Survey;

constexpr std::size_t kSurveyedPoses = 40;

void calibrate_from(const Survey& survey, IdentifyData& data) {
  data.geometry = learn_geometry(data.machine, survey);
  if (data.geometry->summary.usable) return;
  for (const std::string& reason : data.geometry->summary.reasons)
    data.findings.push_back(survey.source + ": survey not used: " + reason);
}

Recording checked(recordings::RecordedFile file, IdentifyData& data) {
  const std::string name = file.recording.source + ": ";
  for (const std::string& note : file.notes) data.findings.push_back(note.starts_with(name) ? note : name + note);
  const DataCheck check = require_data(calibrated(data.machine), file);
  data.findings.push_back(name + "weight balanced, measured over the drawing's: " + check.weights());
  for (const std::string& line : check.lines()) data.findings.push_back(name + line);
  if (!check.contact.empty())
    data.findings.push_back(name + "the bucket " + contact_text(check.contact, file.recording));
  return std::move(file.recording);
}

/// What is held out must be new, and nothing may count twice. @param earlier as read, like `recording`.
void require_new(const std::vector<Recording>& earlier, const Recording& recording) {
  constexpr double kMostShared = 0.2;
  for (const Recording& other : earlier) {
    const double share = std::max(shared_samples(other, recording), shared_samples(recording, other));
    if (share > kMostShared)
      throw InputError(recording.source + ": " + std::to_string(std::lround(100 * share)) +
                       " % of it is the same as in " + other.source +
                       ": held-out data must not be used for identification, and nothing may be given twice");
  }
}

/// The end of each recording is held out.
void split(std::vector<Recording> all, double share, IdentifyData& data) {
  for (const Recording& recording : all) {
    const auto count = recording.samples.size();
    const auto cut = count - static_cast<std::size_t>(std::round(share * static_cast<double>(count)));
    data.training.push_back(recordings::part_of(recording, 0, cut));
    data.hold_out.push_back(recordings::part_of(recording, cut, count));
    data.hold_out.back().source += ", last " + std::to_string(std::lround(100 * share)) + " %";
  }
}

/// Knuckle's own recording as if it had been read from its file.
recordings::RecordedFile as_read(Recording recording) {
  recordings::RecordedFile file{std::move(recording), {}, {}, 0, {}};
  file.rows_read = file.recording.samples.size();
  std::copy(recordings::kSignalNames.begin(), recordings::kSignalNames.end(), file.columns.begin());
  for (std::size_t i = 0; i < file.rows_read; ++i) file.rows.push_back(i + 2);
  return file;
}

/// As it goes into a file: to 0.01 mm.
Survey rounded(Survey survey) {
  const auto round = [](auto& values) { values = ((values * 1e5).array().round() / 1e5).matrix().eval(); };
  for (estimation::SurveyPose& pose : survey.poses) {
    round(pose.cylinder_m);
    round(pose.arm_pin_m);
    round(pose.bucket_pin_m);
    round(pose.tip_m);
  }
  return survey;
}

/// What was driven, by the names of its files.
struct Driven {
  Survey survey;
  std::vector<Recording> training, hold_out;
  std::map<std::string, double> truth;
};

Recording named(const std::string& name, motion::MachineRecording made) {
  made.recording.source = name;
  return std::move(made.recording);
}

Driven drive_full(const IdentifyOptions& options, const MachineDescription& nominal, const sim::MachineTruth& truth,
                  const std::function<void(double)>& progress, const std::function<void(const Survey&)>& posed) {
  CommissionRuns runs = run_commissioning(nominal, truth, commission_plan(options), options.seed, progress, posed);
  return {rounded(std::move(runs.survey)),
          {named("slow", std::move(runs.slow)), named("fast", std::move(runs.fast))},
          {named("hold_out_slow", std::move(runs.validation_slow)),
           named("hold_out_digging", std::move(runs.validation_digging))},
          {}};
}

Driven drive_paper(const IdentifyOptions& options, const MachineDescription& nominal, const sim::MachineTruth& truth,
                   const std::function<void(double)>& progress) {
  const MachineDescription machine = calibrated(nominal);
  const CommissionPlan plan = commission_plan(options);
  motion::MachineRun run(machine, truth, {}, middle_of_range(machine), options.seed);
  run.watch([&](double elapsed_s) { progress(std::min(1.0, elapsed_s / plan.duration_s())); });
  Driven driven;
  driven.survey = rounded(run.survey(estimation::survey_poses(machine, plan.survey_poses), plan.survey_sigma_m));
  const BaselineRuns paper = run_baseline(options.method, machine, run, options.seed);
  for (const motion::MachineRecording& made : paper.identification)
    driven.training.push_back(named(options.method + "_" + std::to_string(driven.training.size() + 1), made));
  for (const motion::MachineRecording& made : paper.verification)
    driven.hold_out.push_back(named("verification_" + std::to_string(driven.hold_out.size() + 1), made));
  driven.truth = baseline_truth(options.method, machine, truth, paper);
  return driven;
}

/// Collects files in the order of their digest, and writes them where they are to be kept.
class Keeper {
 public:
  explicit Keeper(std::string folder) : folder_(std::move(folder)) {}
  void keep(const std::string& name, const std::string& text) {
    digest_.add(text);
    if (folder_.empty()) return;
    cli::OutputFile file("--record", (fs::path(folder_) / name).string());
    file.stream() << text;
    file.commit();
  }
  void keep(const std::string& name, const Recording& recording) {
    std::ostringstream text;
    recordings::write_recording(recording, text);
    keep(name, text.str());
  }
  std::string digest() { return digest_.finish(); }

 private:
  std::string folder_;
  cli::Digest digest_;
};

}  // namespace

IdentifyData read_data(const IdentifyOptions& options) {
  IdentifyData data;
  data.machine = load_machine(find_config("machine", options.machine));
  if (!options.survey.empty()) {
    calibrate_from(read_survey(options.survey, 1e-3 * options.survey_sigma_mm), data);
    // Somebody measured it to be used: a file made of the drawing instead would only look like it.
    if (!data.geometry->summary.usable)
      throw InputError(options.survey + ": cannot be used: " + data.geometry->summary.reasons.front());
  }
  cli::Digest digest;
  std::vector<Recording> seen;
  const auto read = [&](const std::vector<std::string>& files) {
    std::vector<Recording> recordings;
    for (const std::string& file : files) {
      data.source += (data.source.empty() ? "" : ", ") + fs::path(file).filename().string();
      recordings::RecordedFile recorded = recordings::read_recording(file, options.map, calibrated(data.machine));
      digest.add_file(file);
      require_new(seen, recorded.recording);
      seen.push_back(recorded.recording);
      recordings.push_back(checked(std::move(recorded), data));
    }
    return recordings;
  };
  data.training = read(options.recordings);
  data.hold_out = read(options.hold_out_files);
  if (data.hold_out.empty()) split(std::move(data.training), options.hold_out_share, data);
  if (!options.survey.empty()) {
    digest.add(whole_file(options.survey, recordings::kLargestCsv_MB));
    data.source += ", " + fs::path(options.survey).filename().string();
  }
  data.sha256 = digest.finish();
  return data;
}

CommissionPlan commission_plan(const IdentifyOptions& options) {
  const double held_out_s = std::clamp(0.3 * (options.slow_s + options.fast_s), 20.0, 60.0);
  CommissionPlan plan{.survey_poses = kSurveyedPoses,
                      .survey_sigma_m = 1e-3 * options.survey_sigma_mm,
                      .slow_s = options.slow_s,
                      .fast_s = options.fast_s,
                      .validation_s = held_out_s};
  set_surveyor(session::family_named(options.family), plan);
  return plan;
}

IdentifyData drive_for_data(const IdentifyOptions& options, const std::function<void(double)>& progress,
                            const std::function<void(const Survey&)>& posed) {
  IdentifyData data;
  data.machine = load_machine(find_config("machine", options.machine));
  const sim::MachineTruth truth = session::truth_for(data.machine, options.truth, options.family, options.seed);
  Keeper keeper(options.record);
  Driven driven = options.method == "full" ? drive_full(options, data.machine, truth, progress, posed)
                                           : drive_paper(options, data.machine, truth, progress);
  calibrate_from(driven.survey, data);
  const auto take = [&](std::vector<Recording>& from, std::vector<Recording>& into) {
    for (Recording& recording : from) {
      keeper.keep(recording.source + ".csv", recording);
      into.push_back(checked(as_read(std::move(recording)), data));
    }
  };
  take(driven.training, data.training);
  take(driven.hold_out, data.hold_out);
  data.truth = std::move(driven.truth);
  std::ostringstream table;
  write_survey(driven.survey, table);
  keeper.keep("survey.csv", table.str());
  data.sha256 = keeper.digest();
  data.source = "simulated " + data.machine.name + ", seed " + std::to_string(options.seed);
  return data;
}

}  // namespace knuckle::identify
