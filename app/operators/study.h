// What a study's recordings say: for each task and metric, the mean of every condition, and the differences between
// them.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "app/operators/intervals.h"
#include "app/operators/plan.h"
#include "app/operators/task_metrics.h"

namespace knuckle::operators {

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

}  // namespace knuckle::operators
