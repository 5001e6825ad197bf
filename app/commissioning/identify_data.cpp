#include "app/commissioning/identify_data.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "app/commissioning/baseline_runs.h"
#include "app/commissioning/data_check.h"
#include "app/commissioning/machine_run.h"
#include "app/commissioning/recording_reader.h"
#include "app/commissioning/survey_file.h"
#include "app/digest.h"
#include "app/output_file.h"
#include "core/error.h"
#include "estimation/identification/excitation.h"
#include "machine/load.h"

namespace knuckle::app {
namespace {
namespace fs = std::filesystem;

using estimation::Recording;
using estimation::Survey;

constexpr std::size_t kSurveyedPoses = 40;
constexpr double kSurveySigma_m = 1e-3;

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Lengths and pins first: angles and levers of everything else hang on them.
void calibrate_from(const Survey& survey, IdentifyData& data) {
  data.geometry = estimation::calibrate_geometry(data.machine, survey);
  if (data.geometry->summary.usable) {
    data.machine.geometry_calibration = data.geometry->geometry;
    return;
  }
  for (const std::string& reason : data.geometry->summary.reasons)
    data.findings.push_back(survey.source + ": survey not used: " + reason);
}

Recording checked(RecordedFile file, IdentifyData& data) {
  const std::string name = file.recording.source + ": ";
  for (const std::string& note : file.notes) data.findings.push_back(note.starts_with(name) ? note : name + note);
  for (const std::string& line : require_data(calibrated(data.machine), file).lines())
    data.findings.push_back(name + line);
  return std::move(file.recording);
}

/// The end of each recording is held out.
void split(std::vector<Recording> all, double share, IdentifyData& data) {
  for (const Recording& recording : all) {
    const auto count = recording.samples.size();
    const auto cut = count - static_cast<std::size_t>(std::round(share * static_cast<double>(count)));
    data.training.push_back(part_of(recording, 0, cut));
    data.hold_out.push_back(part_of(recording, cut, count));
    data.hold_out.back().source += ", last " + std::to_string(std::lround(100 * share)) + " %";
  }
}

/// Knuckle's own recording as if it had been read from its file.
RecordedFile as_read(Recording recording) {
  RecordedFile file{std::move(recording), {}, {}, 0, {}};
  file.rows_read = file.recording.samples.size();
  std::copy(kSignalNames.begin(), kSignalNames.end(), file.columns.begin());
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

JointVector middle_of_range(const MachineDescription& machine) {
  JointVector middle;
  for (std::size_t i = 0; i < kJoints; ++i)
    middle[static_cast<Eigen::Index>(i)] = (machine.links[i].min_rad + machine.links[i].max_rad) / 2;
  return middle;
}

/// @param done is told the seconds of each part.
Survey surveyed(MachineRun& run, const std::vector<JointVector>& poses, const std::function<void(double)>& done) {
  constexpr std::size_t kAtOnce = 5;  // so that progress shows
  Survey survey;
  for (std::size_t first = 0; first < poses.size(); first += kAtOnce) {
    const auto begin = poses.begin() + static_cast<std::ptrdiff_t>(first);
    const auto end = poses.begin() + static_cast<std::ptrdiff_t>(std::min(poses.size(), first + kAtOnce));
    const Survey some = run.survey({begin, end}, kSurveySigma_m);
    survey.source = some.source;
    survey.point_sigma_m = some.point_sigma_m;
    survey.poses.insert(survey.poses.end(), some.poses.begin(), some.poses.end());
    done(3.0 * kAtOnce);
  }
  return survey;
}

/// Collects files in the order of their digest, and writes them where they are to be kept.
class Keeper {
 public:
  explicit Keeper(std::string folder) : folder_(std::move(folder)) {
    std::error_code error;
    if (!folder_.empty() && !fs::is_directory(folder_) && !fs::create_directories(folder_, error))
      throw InputError("--record " + folder_ + ": cannot be made: " + error.message());
  }
  void keep(const std::string& name, const std::string& text) {
    digest_.add(text);
    if (folder_.empty()) return;
    OutputFile file("--record", (fs::path(folder_) / name).string());
    file.stream() << text;
    file.commit();
  }
  void keep(const std::string& name, const Recording& recording) {
    std::ostringstream text;
    write_recording(recording, text);
    keep(name, text.str());
  }
  std::string digest() { return digest_.finish(); }

 private:
  std::string folder_;
  Digest digest_;
};

}  // namespace

IdentifyData read_data(const IdentifyOptions& options) {
  IdentifyData data;
  data.machine = load_machine(find_config("machine", options.machine));
  if (!options.survey.empty()) calibrate_from(read_survey(options.survey, 1e-3 * options.survey_sigma_mm), data);
  Digest digest;
  const auto read = [&](const std::vector<std::string>& files) {
    std::vector<Recording> recordings;
    for (const std::string& file : files) {
      digest.add(bytes_of(file));
      data.source += (data.source.empty() ? "" : ", ") + fs::path(file).filename().string();
      recordings.push_back(checked(read_recording(file, options.map, calibrated(data.machine)), data));
    }
    return recordings;
  };
  data.training = read(options.recordings);
  data.hold_out = read(options.hold_out_files);
  if (data.hold_out.empty()) split(std::move(data.training), options.hold_out_share, data);
  if (!options.survey.empty()) {
    digest.add(bytes_of(options.survey));
    data.source += ", " + fs::path(options.survey).filename().string();
  }
  data.sha256 = digest.finish();
  return data;
}

IdentifyData drive_for_data(const IdentifyOptions& options, const std::function<void(double)>& progress) {
  IdentifyData data;
  data.machine = load_machine(find_config("machine", options.machine));
  Keeper keeper(options.record);
  const MachineDescription as_known = calibrated(data.machine);
  const double held_out_s = std::clamp(0.3 * (options.slow_s + options.fast_s), 20.0, 60.0);
  const double all_s = options.slow_s + options.fast_s + 2 * held_out_s + 3.0 * kSurveyedPoses;
  double done_s = 0;
  const auto done = [&](double more_s) { progress(std::min(1.0, (done_s += more_s) / all_s)); };
  done(0);
  const sim::MachineTruth truth = sim::draw_truth(data.machine, options.seed);
  MachineRun run(as_known, truth, {}, middle_of_range(as_known), options.seed);
  const Survey survey = rounded(surveyed(run, estimation::survey_poses(as_known, kSurveyedPoses), done));
  calibrate_from(survey, data);
  const auto taken = [&](const std::string& name, Recording recording) {
    recording.source = name;
    done(recording.duration_s());
    keeper.keep(name + ".csv", recording);
    return checked(as_read(std::move(recording)), data);
  };
  if (options.method == "full") {
    using estimation::MotionSpeed;
    const auto held_out = [&](MotionSpeed speed) {
      return run.follow(estimation::held_out_motion(as_known, options.seed + 100, speed, held_out_s)).recording;
    };
    data.training.push_back(taken("slow", run.follow(estimation::slow_sweeps(as_known, options.slow_s)).recording));
    data.training.push_back(taken("fast", run.follow(estimation::fast_excitation(as_known, options.fast_s)).recording));
    data.hold_out.push_back(taken("hold_out_slow", held_out(MotionSpeed::kSlow)));
    data.hold_out.push_back(taken("hold_out_digging", held_out(MotionSpeed::kDigging)));
  } else {
    const BaselineRuns paper = run_baseline(options.method, as_known, run, options.seed);
    data.truth = baseline_truth(options.method, as_known, truth, paper);
    for (const MachineRecording& made : paper.identification)
      data.training.push_back(taken(options.method + "_" + std::to_string(data.training.size() + 1), made.recording));
    for (const MachineRecording& made : paper.verification)
      data.hold_out.push_back(taken("verification_" + std::to_string(data.hold_out.size() + 1), made.recording));
  }
  std::ostringstream table;
  write_survey(survey, table);
  keeper.keep("survey.csv", table.str());
  data.sha256 = keeper.digest();
  data.source = "simulated " + data.machine.name + ", seed " + std::to_string(options.seed);
  return data;
}

}  // namespace knuckle::app
