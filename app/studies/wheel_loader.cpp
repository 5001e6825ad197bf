// The rows of a table that a wheel loader's runs give.
#include "app/studies/wheel_loader.h"

#include <numbers>

#include "app/studies/loader_prediction.h"

namespace knuckle::studies {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr const char* kDataset = "wheel_loader";

void append_valve(std::vector<RealRow>& rows, const LoaderValve& valve, const std::string& axis) {
  const auto row = [&](const char* what, double value, const char* unit) {
    rows.push_back({kDataset, axis + " valve: " + what, value, unit, {}});
  };
  row("dead band", valve.dead_band, "of lever");
  row("delay", valve.delay_s, "s");
  row("time constant", valve.lag_s, "s");
  row("saturation", valve.saturation, "of lever");
  row("speed at full lever", valve.full_radps * kDegrees, "deg/s");
  row("change of speed per 0.1 MN of cylinder force", 100 * 0.1 * valve.full_per_MN, "%");
  row("variance explained on held-out motion", 100 * valve.explained, "%");
}

void append_prediction(std::vector<RealRow>& rows, const SpeedPrediction& found, const std::string& axis,
                       bool levers_known) {
  rows.push_back({kDataset,
                  axis + " speed 1 s ahead, RMS error" + (levers_known ? ", levers ahead known" : ""),
                  found.rmse_radps * kDegrees,
                  "deg/s",
                  {{"persistence", found.persistence_radps * kDegrees}, {"ARX", found.arx_radps * kDegrees}}});
}

}  // namespace

std::vector<RealRow> wheel_loader_rows(const std::string& train_dir, const std::string& test_dir) {
  const std::vector<LoaderRun> train = load_loader_runs(train_dir), test = load_loader_runs(test_dir);
  std::vector<RealRow> rows;
  rows.push_back({kDataset, "period from angle and speed", period_from_motion(train.front()), "s", {}});
  for (const LoaderAxis axis : {kLift, kTilt}) {
    append_valve(rows, identify_loader_valve(train, test, axis), kLoaderAxisNames[axis]);
  }
  for (const bool levers_known : {false, true}) {
    const auto found = predict_speeds(train, test, levers_known);
    for (std::size_t axis = 0; axis < kLoaderAxes; ++axis) {
      append_prediction(rows, found[axis], kLoaderAxisNames[axis], levers_known);
    }
  }
  return rows;
}

}  // namespace knuckle::studies
