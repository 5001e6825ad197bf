#include "app/operators/study.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <filesystem>
#include <map>
#include <numeric>
#include <set>

#include "machine/toml_reader.h"

namespace knuckle::operators {

MeanInterval mean_interval(const std::vector<double>& values) {
  MeanInterval interval;
  interval.n = values.size();
  if (values.empty()) return interval;
  const auto n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  interval.mean = mean;
  if (values.size() < 2) return interval;
  double squares = 0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  const double t = boost::math::quantile(boost::math::students_t(n - 1), 0.975);
  interval.half_width = t * std::sqrt(squares / (n - 1) / n);
  return interval;
}

namespace {

PlannedRecording read_recording(TomlTable& table, const std::filesystem::path& folder) {
  PlannedRecording recording;
  recording.file = (folder / table.text("file")).lexically_normal().string();
  recording.participant = table.text("participant");
  recording.input = table.text("input");
  recording.condition = table.text("condition");
  recording.task = table.text("task");
  if (table.has("tlx")) {
    TomlTable tlx = table.table("tlx");
    TaskLoad load{};
    for (std::size_t i = 0; i < load.size(); ++i) load[i] = tlx.number(kLoadScales[i], 0, 100);
    recording.load = load;
  }
  return recording;
}

}  // namespace

std::vector<PlannedRecording> load_plan(const std::string& path) {
  TomlTable plan = TomlTable::read(path, false);
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  std::vector<PlannedRecording> recordings;
  std::set<std::string> files;
  for (TomlTable& table : plan.tables("recording")) {
    recordings.push_back(read_recording(table, folder));
    table.require(files.insert(recordings.back().file).second, "file", "is listed before");
  }
  plan.require(!recordings.empty(), "recording", "at least one [[recording]] is needed");
  plan.finish();
  return recordings;
}

namespace {

/// Mean of each participant's trials.
using PerParticipant = std::map<std::string, double>;

struct Quantity {
  std::string name, unit;
  std::vector<Metric> values;  ///< Of each recording.
};

Metric raw_load(const std::optional<TaskLoad>& load) {
  if (!load) return std::nullopt;
  return std::accumulate(load->begin(), load->end(), 0.0) / static_cast<double>(load->size());
}

/// All that is averaged: the metrics, the six scales and their mean (the "raw" index).
std::vector<Quantity> quantities_of(const std::vector<MeasuredRecording>& recordings) {
  std::vector<Quantity> quantities;
  const auto add = [&](const std::string& name, const std::string& unit, const auto& value_of) {
    Quantity quantity{name, unit, {}};
    for (const MeasuredRecording& recording : recordings) quantity.values.push_back(value_of(recording));
    quantities.push_back(std::move(quantity));
  };
  for (const MetricInfo& info : kMetrics)
    add(info.name, info.unit, [&](const MeasuredRecording& r) { return r.metrics.*info.value; });
  for (std::size_t i = 0; i < kLoadScales.size(); ++i)
    add(std::string("tlx_") + kLoadScales[i], "1",
        [i](const MeasuredRecording& r) { return r.plan.load ? Metric((*r.plan.load)[i]) : std::nullopt; });
  add("tlx_raw", "1", [](const MeasuredRecording& r) { return raw_load(r.plan.load); });
  return quantities;
}

/// The texts of a field, each once, in the order of the plan.
std::vector<std::string> values_of(const std::vector<MeasuredRecording>& recordings, Factor field) {
  std::vector<std::string> values;
  for (const MeasuredRecording& recording : recordings) {
    if (std::find(values.begin(), values.end(), recording.plan.*field) == values.end())
      values.push_back(recording.plan.*field);
  }
  return values;
}

PerParticipant participants_of(const std::vector<MeasuredRecording>& recordings, const std::vector<Metric>& values,
                               const std::string& task, Factor factor, const std::string& level) {
  std::map<std::string, std::vector<double>> trials;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    const PlannedRecording& plan = recordings[i].plan;
    if (recordings[i].whole() && plan.task == task && plan.*factor == level && values[i])
      trials[plan.participant].push_back(*values[i]);
  }
  PerParticipant means;
  for (const auto& [participant, own] : trials)
    means[participant] = std::accumulate(own.begin(), own.end(), 0.0) / static_cast<double>(own.size());
  return means;
}

MeanInterval interval_of(const PerParticipant& values) {
  std::vector<double> numbers;
  for (const auto& [participant, value] : values) numbers.push_back(value);
  return mean_interval(numbers);
}

/// Of those who did both.
PerParticipant differences(const PerParticipant& of, const PerParticipant& minus) {
  PerParticipant both;
  for (const auto& [participant, value] : of) {
    if (const auto other = minus.find(participant); other != minus.end()) both[participant] = value - other->second;
  }
  return both;
}

}  // namespace

std::vector<StudyRow> study_rows(const std::vector<MeasuredRecording>& recordings, Factor factor) {
  const std::vector<Quantity> quantities = quantities_of(recordings);
  const std::vector<std::string> levels = values_of(recordings, factor);
  std::vector<StudyRow> rows;
  for (const std::string& task : values_of(recordings, &PlannedRecording::task)) {
    for (const Quantity& quantity : quantities) {
      std::vector<PerParticipant> means;
      for (const std::string& level : levels) {
        means.push_back(participants_of(recordings, quantity.values, task, factor, level));
        if (means.back().empty()) continue;
        rows.push_back({task, quantity.name, quantity.unit, level, "", interval_of(means.back())});
      }
      for (std::size_t a = 0; a < levels.size(); ++a) {
        for (std::size_t b = a + 1; b < levels.size(); ++b) {
          const PerParticipant both = differences(means[b], means[a]);
          if (both.size() < 2) continue;
          rows.push_back({task, quantity.name, quantity.unit, levels[b], levels[a], interval_of(both)});
        }
      }
    }
  }
  return rows;
}

}  // namespace knuckle::operators
