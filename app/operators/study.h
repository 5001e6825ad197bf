// What a study's recordings say: for each task and metric, the mean of every condition, and the differences between
// them.
#pragma once

#include <array>
#include <cstddef>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "app/cli/command.h"
#include "app/operators/task_metrics.h"

namespace knuckle::operators {

/// Of a mean of n independent values, each of one participant.
struct MeanInterval {
  std::size_t n = 0;
  std::optional<double> mean;        ///< None where n = 0.
  std::optional<double> half_width;  ///< Of the 95 % interval; none where n < 2.
};

/// Mean, and Student's t times its standard error: mean +- t(0.975, n - 1) s / sqrt(n).
[[nodiscard]] MeanInterval mean_interval(const std::vector<double>& values);

// Which recordings a study has: who did what, with which input, under which condition.

/// Scales of NASA's task load index, each 0 to 100 (Hart, Staveland 1988); performance: 100 is failure.
inline constexpr std::array<const char*, 6> kLoadScales{"mental",      "physical", "temporal",
                                                        "performance", "effort",   "frustration"};
using TaskLoad = std::array<double, kLoadScales.size()>;

struct PlannedRecording {
  std::string file;  ///< As it can be opened.
  std::string participant, input, condition, task;
  std::optional<TaskLoad> load;  ///< As the participant answered.
};

/// @throws InputError with file, line, key, value and bound. Files are relative to the plan's folder.
[[nodiscard]] std::vector<PlannedRecording> load_plan(const std::string& path);

struct MeasuredRecording {
  PlannedRecording plan;
  TaskMetrics metrics;
  std::vector<std::string> flaws;  ///< As TaskRecording::flaws.
  [[nodiscard]] bool whole() const noexcept { return flaws.empty(); }
};

/// What is compared: PlannedRecording::condition or ::input.
using Factor = std::string PlannedRecording::*;

/// One line of the table.
struct StudyRow {
  std::string task, metric, unit;
  std::string of;         ///< A condition.
  std::string minus;      ///< Where it is the difference to another: that one; else empty.
  MeanInterval interval;  ///< Over participants: means of those who have the metric; or their own differences.
};

/// Tasks and conditions in the order of the plan. A participant's trials of one condition count as their mean. Rows of
/// what nobody has are left out, and so are differences for which fewer than two participants did both. A recording
/// that is not whole is no trial: nothing of it counts, as nobody knows how the task went on.
[[nodiscard]] std::vector<StudyRow> study_rows(const std::vector<MeasuredRecording>& recordings, Factor factor);

void print_rows(const std::vector<StudyRow>& rows, std::ostream& out);
/// Those that do not count, and why; nothing where all do.
void print_left_out(const std::vector<MeasuredRecording>& recordings, std::ostream& out);
/// One row for each recording, with all its metrics; what is none is empty.
void write_csv(const std::vector<MeasuredRecording>& recordings, std::ostream& out);
/// Schema knuckle-operators/1 (docs/studies.md).
void write_json(const std::vector<MeasuredRecording>& recordings, const std::vector<StudyRow>& rows,
                const std::string& by, std::ostream& out);

/// `knuckle-studies operators`: persons at work, from their recordings to one table.
[[nodiscard]] cli::Command operators_entry();

}  // namespace knuckle::operators
