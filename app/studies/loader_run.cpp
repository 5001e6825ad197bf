// Import of a loader's run through its mapping file.
#include "app/studies/loader_run.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "app/recordings/csv_reader.h"
#include "core/error.h"
#include "machine/load.h"

namespace knuckle::studies {
namespace {

constexpr double kPeriodAgrees = 0.03;  ///< Relative.
constexpr std::size_t kLeastRows = 400;

/// Rows of a fixed period, none missing: what is not known holds its last value, as a reader at run time would.
std::vector<double> held(const recordings::MappedTable& table, const std::string& name, double step_s) {
  const std::vector<double>& values = table.channel(name).values;
  const auto count = static_cast<std::size_t>(std::lround(table.time_s.back() / step_s)) + 1;
  std::vector<double> result(count);
  double last = 0;
  std::size_t row = 0;
  for (std::size_t i = 0; i < count; ++i) {
    while (row < values.size() && std::lround(table.time_s[row] / step_s) <= static_cast<long>(i)) {
      if (std::isfinite(values[row])) last = values[row];
      ++row;
    }
    result[i] = last;
  }
  return result;
}

LoaderRun load_loader_run(const std::string& path) {
  constexpr double kStep_s = 0.05;  // of the mapping
  const recordings::MappedTable table = recordings::read_mapped_csv(path, find_config("map", "wheel_loader"));
  LoaderRun run;
  run.source = path;
  run.step_s = kStep_s;
  run.report = table.report();
  for (std::size_t axis = 0; axis < kLoaderAxes; ++axis) {
    const std::string name = kLoaderAxisNames[axis];
    run.angle_rad[axis] = held(table, name + "_rad", kStep_s);
    run.speed_radps[axis] = held(table, name + "_radps", kStep_s);
    run.lever[axis] = held(table, name + "_lever", kStep_s);
    run.force_MN[axis] = held(table, name + "_force_MN", kStep_s);
  }
  run.engine_rps = held(table, "engine_rps", kStep_s);
  run.drive_axle_rps = held(table, "drive_axle_rps", kStep_s);
  run.throttle = held(table, "throttle", kStep_s);
  run.gear = held(table, "gear", kStep_s);
  run.digging = held(table, "digging", kStep_s);
  if (run.size() < kLeastRows) {
    table.refuse("only " + std::to_string(run.size()) + " rows, at least " + std::to_string(kLeastRows) +
                 " are needed");
  }
  const double period_s = period_from_motion(run);
  if (!(std::abs(period_s / kStep_s - 1) < kPeriodAgrees)) {
    table.refuse("angle and speed give a sampling period of " + std::to_string(period_s) + " s, the mapping has " +
                 std::to_string(kStep_s) + " s");
  }
  return run;
}

}  // namespace

double period_from_motion(const LoaderRun& run) {
  constexpr std::size_t kStretch = 40;
  const std::vector<double>&angle = run.angle_rad[kLift], &speed = run.speed_radps[kLift];
  double turned2 = 0, product = 0, summed2 = 0;
  for (std::size_t i = 0; i + kStretch < run.size(); ++i) {
    double summed = 0.5 * (speed[i] + speed[i + kStretch]);
    for (std::size_t k = 1; k < kStretch; ++k) summed += speed[i + k];
    const double turned = angle[i + kStretch] - angle[i];
    turned2 += turned * turned;
    product += turned * summed;
    summed2 += summed * summed;
  }
  // Geometric mean of the regressions both ways.
  return product > 0 ? std::sqrt(turned2 / summed2) : 0;
}

std::vector<LoaderRun> load_loader_runs(const std::string& folder) {
  namespace fs = std::filesystem;
  std::vector<std::string> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (entry->path().extension() == ".csv") files.push_back(entry->path().string());
  }
  if (error) throw InputError(folder + ": cannot be read: " + error.message());
  if (files.empty()) throw InputError(folder + ": no .csv file");
  std::sort(files.begin(), files.end());
  std::vector<LoaderRun> runs;
  for (const std::string& file : files) runs.push_back(load_loader_run(file));
  return runs;
}

}  // namespace knuckle::studies
