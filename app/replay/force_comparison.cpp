#include "app/replay/force_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/recordings/csv_cells.h"
#include "core/error.h"
#include "core/quantile.h"
#include "core/time.h"
#include "estimation/force_estimator.h"

namespace knuckle::replay {
namespace {

constexpr double kTimeUnit_s = 1e-4;  // steps are further apart, and a table's digits tell as much
constexpr double kSameForce = 1e-6;   // of a force, or N: a table has ten digits
constexpr const char* kTimeColumn = "time_s";

std::int64_t key_of(double time_s) noexcept {
  return std::llround(time_s / kTimeUnit_s);
}

/// The model neither refuses the pose, nor does the estimator repeat an older answer.
bool answers(const slave::SlaveState& state) noexcept {
  using namespace estimation;
  constexpr unsigned kNoAnswer =
      kStraightArm | kBucketInLine | kNearToggle | kDirectionAlongLink | kOffTheBucket | kNoDirection | kBadInput;
  return (state.confidence_reasons & kNoAnswer) == 0 && state.tip_force_N.allFinite();
}

std::string median_and_p95(const std::vector<double>& sizes_N) {
  if (sizes_N.empty()) return fmt::format("  {:>10} {:>10}", "-", "-");
  return fmt::format("  {:>10.1f} {:>10.1f}", median(sizes_N), quantile(sizes_N, 0.95));
}

}  // namespace

ForceComparison::ForceComparison(ContactModel recorded, ContactModel replayed, const std::string& session_table)
    : table_(session_table), models_{Model{.model = recorded}, Model{.model = replayed}} {
  if (!table_.empty()) read(table_);
}

void ForceComparison::read(const std::string& session_table) {
  const std::vector<std::string> names{kTimeColumn, "truth_tip_force_x_N", "truth_tip_force_z_N", "tip_force_x_N",
                                       "tip_force_z_N"};
  recordings::CsvFile file = recordings::read_cells(session_table, names);
  std::vector<std::size_t> columns;
  for (const std::string& name : names) columns.push_back(recordings::column_index(file, name));
  recordings::find_decimal_mark(file, columns);
  for (std::size_t i = 1; i < file.rows.size(); ++i) {
    const recordings::Cells& cells = file.rows[i];
    const auto number = [&](std::size_t column) {
      return columns[column] < cells.size() ? file.number(cells[columns[column]]) : std::nan("");
    };
    const double time_s = number(0);
    const Row row{{number(1), number(2)}, {number(3), number(4)}};
    if (std::isfinite(time_s) && row.true_N.allFinite()) rows_[key_of(time_s)] = row;
  }
}

void ForceComparison::add(const slave::SlaveState& recorded, const slave::SlaveState& replayed) {
  if (!recorded.measured || !replayed.measured) return;
  ++steps_;
  const auto row = rows_.find(key_of(to_seconds(recorded.at)));
  const bool known = row != rows_.end();
  if (known &&
      (row->second.estimated_N - recorded.tip_force_N).norm() > kSameForce * std::max(1.0, recorded.tip_force_N.norm()))
    throw InputError(
        fmt::format("{}: is of another session than the recording: at {:.4f} s its tip_force_N is {:.6g}, {:.6g}, "
                    "recorded {:.6g}, {:.6g}",
                    table_, to_seconds(recorded.at), row->second.estimated_N.x(), row->second.estimated_N.y(),
                    recorded.tip_force_N.x(), recorded.tip_force_N.y()));
  const std::array states{&recorded, &replayed};
  for (std::size_t i = 0; i < models_.size(); ++i) {
    if (!answers(*states[i])) continue;
    ++models_[i].answered;
    if (!known) continue;
    const double off_N = (states[i]->tip_force_N - row->second.true_N).norm();
    models_[i].off_N.push_back(off_N);
    if (row->second.true_N.norm() > kTouching_N) models_[i].off_touching_N.push_back(off_N);
  }
  if (answers(recorded) && answers(replayed)) apart_N_.push_back((replayed.tip_force_N - recorded.tip_force_N).norm());
}

std::string ForceComparison::text() const {
  if (steps_ == 0) return {};
  const bool with_truth = !table_.empty();
  if (with_truth && models_[0].off_N.empty() && models_[1].off_N.empty())
    throw InputError(table_ + ": has no row of a step of this recording in which a model answered");
  std::string text = fmt::format("force by contact model, in {} steps:\n  {:<32} {:>9}  {:>21}", steps_, "", "",
                                 "beside the other, N");
  if (with_truth) text += fmt::format("  {:>21}  {:>21}", "off the true force, N", "off it, touching, N");
  text += fmt::format("\n  {:<32} {:>9}", "contact model", "answered");
  for (int i = 0; i < (with_truth ? 3 : 1); ++i) text += fmt::format("  {:>10} {:>10}", "median", "p95");
  for (const Model& model : models_) {
    const char* const which = &model == &models_[0] ? "recorded" : "replayed";
    text += fmt::format("\n  {:<32} {:>7.1f} %", fmt::format("{}, {}", name(model.model), which),
                        100.0 * static_cast<double>(model.answered) / static_cast<double>(steps_)) +
            median_and_p95(apart_N_);
    if (with_truth) text += median_and_p95(model.off_N) + median_and_p95(model.off_touching_N);
  }
  return text + '\n';
}

}  // namespace knuckle::replay
