// The table of a study as text, and all of it as CSV and JSON.
#include <fmt/format.h>

#include <algorithm>
#include <ostream>
#include <utility>

#include "app/cli/json.h"
#include "app/operators/study.h"

namespace knuckle::operators {
namespace {

using cli::Json;

std::string of_text(const StudyRow& row) {
  return row.minus.empty() ? row.of : row.of + " - " + row.minus;
}

std::string interval_text(const MeanInterval& interval) {
  if (!interval.half_width) return "-";
  return fmt::format("[{:.4g}, {:.4g}]", *interval.mean - *interval.half_width, *interval.mean + *interval.half_width);
}

Json json_of(const Metric& value) {
  return value ? Json(*value) : Json(nullptr);
}

std::string csv_text(const std::string& text) {
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

Json json_of(const MeasuredRecording& recording) {
  const PlannedRecording& plan = recording.plan;
  Json json{
      {"file", plan.file}, {"participant", plan.participant}, {"input", plan.input},     {"condition", plan.condition},
      {"task", plan.task}, {"whole", recording.whole()},      {"flaws", recording.flaws}};
  for (const MetricInfo& info : kMetrics) json["metrics"][info.name] = json_of(recording.metrics.*info.value);
  json["tlx"] = nullptr;
  for (std::size_t i = 0; plan.load && i < kLoadScales.size(); ++i) json["tlx"][kLoadScales[i]] = (*plan.load)[i];
  return json;
}

}  // namespace

void print_rows(const std::vector<StudyRow>& rows, std::ostream& out) {
  std::size_t width = 9;
  for (const StudyRow& row : rows) width = std::max(width, of_text(row).size());
  std::string task, metric;
  for (const StudyRow& row : rows) {
    if (row.task != task) {
      out << fmt::format("{}task {}: means over participants, 95 % confidence intervals of Student's t\n",
                         task.empty() ? "" : "\n", row.task);
      out << fmt::format("  {:<20} {:>4}  {:<{}} {:>10}  {:<22} {:>3}\n", "metric", "unit", "of", width, "mean",
                         "interval", "n");
      task = row.task;
      metric.clear();
    }
    const bool same = row.metric == metric;
    out << fmt::format("  {:<20} {:>4}  {:<{}} {:>10.4g}  {:<22} {:>3}\n", same ? "" : row.metric, same ? "" : row.unit,
                       of_text(row), width, row.interval.mean.value_or(0), interval_text(row.interval), row.interval.n);
    metric = row.metric;
  }
}

void print_left_out(const std::vector<MeasuredRecording>& recordings, std::ostream& out) {
  bool first = true;
  for (const MeasuredRecording& recording : recordings) {
    if (recording.whole()) continue;
    if (std::exchange(first, false)) out << "\nLeft out of all means, as these recordings are not whole:\n";
    out << fmt::format("  {}, {}, task {}: {}\n", recording.plan.participant, recording.plan.condition,
                       recording.plan.task, recording.flaws.front());
  }
}

void write_csv(const std::vector<MeasuredRecording>& recordings, std::ostream& out) {
  out << "file,participant,input,condition,task";
  for (const MetricInfo& info : kMetrics)
    out << ',' << info.name << (std::string_view(info.unit) == "1" ? "" : std::string("_") + info.unit);
  for (const char* scale : kLoadScales) out << ",tlx_" << scale;
  out << ",whole\n";
  for (const MeasuredRecording& recording : recordings) {
    const PlannedRecording& plan = recording.plan;
    out << fmt::format("{},{},{},{},{}", csv_text(plan.file), csv_text(plan.participant), csv_text(plan.input),
                       csv_text(plan.condition), csv_text(plan.task));
    for (const MetricInfo& info : kMetrics) {
      const Metric value = recording.metrics.*info.value;
      out << ',' << (value ? fmt::format("{:.10g}", *value) : "");
    }
    for (std::size_t i = 0; i < kLoadScales.size(); ++i)
      out << ',' << (plan.load ? fmt::format("{:.10g}", (*plan.load)[i]) : "");
    out << (recording.whole() ? ",1\n" : ",0\n");
  }
}

void write_json(const std::vector<MeasuredRecording>& recordings, const std::vector<StudyRow>& rows,
                const std::string& by, std::ostream& out) {
  Json json{{"schema", "knuckle-operators/1"}, {"by", by}, {"recordings", Json::array()}, {"rows", Json::array()}};
  for (const MeasuredRecording& recording : recordings) json["recordings"].push_back(json_of(recording));
  for (const StudyRow& row : rows) {
    json["rows"].push_back({{"task", row.task},
                            {"metric", row.metric},
                            {"unit", row.unit},
                            {"of", row.of},
                            {"minus", row.minus.empty() ? Json(nullptr) : Json(row.minus)},
                            {"n", row.interval.n},
                            {"mean", json_of(row.interval.mean)},
                            {"half_width", json_of(row.interval.half_width)}});
  }
  out << json.dump(2) << '\n';
}

}  // namespace knuckle::operators
