#include "app/identify/identify_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>
#include <numeric>
#include <sstream>

#include "app/cli/digest.h"
#include "app/cli/output_file.h"
#include "app/identify/baseline_report.h"
#include "app/identify/data_check.h"
#include "app/recordings/csv_cells.h"
#include "app/recordings/recording_reader.h"
#include "app/session/truth_file.h"
#include "core/error.h"
#include "core/text.h"
#include "estimation/identification/excitation.h"
#include "machine/file_text.h"
#include "machine/kinematics.h"
#include "machine/load.h"

namespace knuckle::identify {
namespace {

// Whether two recordings are one: what is held out must not have been identified from, and nothing counts twice.

using Values = std::array<double, recordings::kSignalChannels>;

/// Sorted, each once.
std::vector<Values> values_of(const estimation::Recording& recording) {
  std::vector<Values> values;
  for (std::size_t i = 0; i < recording.samples.size(); ++i) {
    if (recording.usable[i] == 0) continue;
    values.emplace_back();
    for (std::size_t c = 0; c < recordings::kSignalChannels; ++c)
      values.back()[c] = recordings::signal(recording.samples[i], c);
  }
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

/// Share of b's usable samples that are in a, every signal to the last digit; pressures never repeat by themselves.
double shared_samples(const estimation::Recording& a, const estimation::Recording& b) {
  const std::vector<Values> of_a = values_of(a), of_b = values_of(b);
  std::vector<Values> both;
  std::set_intersection(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(), std::back_inserter(both));
  return of_b.empty() ? 0 : static_cast<double>(both.size()) / static_cast<double>(of_b.size());
}

constexpr std::size_t kEncoders = 3, kValues = 9;  // of a pose: readings, then three points
constexpr std::array<const char*, kValues> kNames{"boom_encoder", "arm_encoder", "bucket_encoder",
                                                  "arm_pin_x",    "arm_pin_z",   "bucket_pin_x",
                                                  "bucket_pin_z", "tip_x",       "tip_z"};

struct Column {
  std::size_t value;  ///< Index in kNames.
  double factor;      ///< Metres a unit.
};

Column column_of(const std::string& path, const std::string& header) {
  for (std::size_t i = 0; i < kValues; ++i) {
    if (header == std::string(kNames[i]) + "_m") return {i, 1};
    if (header == std::string(kNames[i]) + "_mm") return {i, 1e-3};
  }
  throw InputError(path + ": row 1: unknown column '" + shortened(header) + "'; a survey has " + kNames[0] + "_m ... " +
                   kNames[kValues - 1] + "_m, or the same in _mm");
}

std::vector<Column> columns_of(const std::string& path, const recordings::Cells& header) {
  std::vector<Column> columns;
  std::array<int, kValues> seen{};
  for (const std::string& cell : header) {
    columns.push_back(column_of(path, cell));
    if (++seen[columns.back().value] > 1) throw InputError(path + ": row 1: column '" + cell + "' appears twice");
  }
  for (std::size_t i = 0; i < kEncoders; ++i) {
    if (seen[i] == 0) throw InputError(path + ": row 1: no column '" + kNames[i] + "_m'");
  }
  for (std::size_t i = kEncoders; i < kValues; i += 2) {
    if (seen[i] != seen[i + 1]) {
      throw InputError(path + ": row 1: column '" + kNames[seen[i] ? i + 1 : i] + "_m' is missing beside '" +
                       kNames[seen[i] ? i : i + 1] + "'");
    }
  }
  if (std::all_of(seen.begin() + kEncoders, seen.end(), [](int n) { return n == 0; })) {
    throw InputError(path + ": row 1: no surveyed point: arm_pin, bucket_pin or tip, each with _x_m and _z_m");
  }
  return columns;
}

estimation::SurveyPose pose_of(const recordings::CsvFile& file, std::size_t index, const std::vector<Column>& columns) {
  const recordings::Cells &cells = file.rows[index], &header = file.rows.front();
  const std::string where = file.path + ": row " + std::to_string(index + 1) + ": ";
  if (cells.size() != columns.size()) {
    throw InputError(where + std::to_string(cells.size()) + " cells, but " + std::to_string(columns.size()) +
                     " columns");
  }
  std::array<double, kValues> value;
  value.fill(std::numeric_limits<double>::quiet_NaN());
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const bool may_be_empty = columns[c].value >= kEncoders;
    if (cells[c].empty() && may_be_empty) continue;
    value[columns[c].value] = file.number(cells[c]) * columns[c].factor;
    if (!std::isfinite(value[columns[c].value])) {
      throw InputError(where + header[c] + " = '" + shortened(cells[c]) + "': must be a number" +
                       (may_be_empty ? " or empty" : ""));
    }
  }
  for (std::size_t i = kEncoders; i < kValues; i += 2) {
    if (std::isfinite(value[i]) != std::isfinite(value[i + 1])) {
      throw InputError(where + kNames[i] + " and " + kNames[i + 1] + ": give both or none");
    }
  }
  return {{value[0], value[1], value[2]}, {value[3], value[4]}, {value[5], value[6]}, {value[7], value[8]}};
}

}  // namespace

estimation::Survey read_survey(const std::string& path, double point_sigma_m) {
  std::vector<std::string> wanted;
  for (const char* name : kNames)
    for (const char* unit : {"_m", "_mm"}) wanted.push_back(name + std::string(unit));
  recordings::CsvFile file = recordings::read_cells(path, wanted);
  recordings::Cells& header = file.rows.front();
  while (!header.empty() && header.back().empty()) header.pop_back();
  const std::vector<Column> columns = columns_of(path, header);
  std::vector<std::size_t> all(columns.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  recordings::find_decimal_mark(file, all);
  estimation::Survey survey;
  survey.source = path;
  survey.point_sigma_m = point_sigma_m;
  for (std::size_t r = 1; r < file.rows.size(); ++r) {
    recordings::Cells& cells = file.rows[r];
    while (cells.size() > columns.size() && cells.back().empty()) cells.pop_back();
    if (!cells.empty()) survey.poses.push_back(pose_of(file, r, columns));  // else a blank line
  }
  if (survey.poses.empty()) throw InputError(path + ": no pose below the header");
  return survey;
}

void write_survey(const estimation::Survey& survey, std::ostream& out) {
  for (std::size_t i = 0; i < kValues; ++i) out << (i > 0 ? "," : "") << kNames[i] << "_m";
  out << '\n';
  for (const estimation::SurveyPose& pose : survey.poses) {
    Eigen::Matrix<double, kValues, 1> values;
    values << pose.cylinder_m, pose.arm_pin_m, pose.bucket_pin_m, pose.tip_m;
    for (std::size_t i = 0; i < kValues; ++i) {
      const double value = values[static_cast<Eigen::Index>(i)];
      out << (i > 0 ? "," : "") << (std::isfinite(value) ? fmt::format("{:.5f}", value) : "");
    }
    out << '\n';
  }
}

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

Driven drive_paper(Paper paper, const IdentifyOptions& options, const MachineDescription& nominal,
                   const sim::MachineTruth& truth, const std::function<void(double)>& progress) {
  const MachineDescription machine = calibrated(nominal);
  const CommissionPlan plan = commission_plan(options);
  motion::MachineRun run(machine, truth, {}, middle_of_range(machine), options.seed);
  run.watch([&](double elapsed_s) { progress(std::min(1.0, elapsed_s / plan.duration_s())); });
  Driven driven;
  driven.survey = rounded(run.survey(estimation::survey_poses(machine, plan.survey_poses), plan.survey_sigma_m));
  const BaselineRuns runs = run_baseline(paper, machine, run, options.seed);
  for (const motion::MachineRecording& made : runs.identification)
    driven.training.push_back(named(std::string(name(paper)) + "_" + std::to_string(driven.training.size() + 1), made));
  for (const motion::MachineRecording& made : runs.verification)
    driven.hold_out.push_back(named("verification_" + std::to_string(driven.hold_out.size() + 1), made));
  driven.truth = baseline_truth(paper, machine, truth, runs);
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
  const auto paper = paper_named(options.method);
  Driven driven = paper ? drive_paper(*paper, options, data.machine, truth, progress)
                        : drive_full(options, data.machine, truth, progress, posed);
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
