#include "app/identify/time_skew.h"

#include <cmath>
#include <vector>

#include "estimation/identification/pressure_lag.h"

namespace knuckle::identify {
namespace {

using estimation::Recording;

// Transmitters lag by 2 to 8 ms and an estimate errs by as much; steps of 50 ms, the slowest, let it err by more.
constexpr double kInStep_s = 0.04;
constexpr double kTellsAlone_s = 35;  // shorter ones hardly identify a machine
// Found on every machine tried. Looked for farther, so that it is no clamped value.
constexpr double kMostTakenOff_s = 0.15;

std::string later(double lag_s) {
  const bool clamped = std::abs(lag_s) >= estimation::kMostPressureLag_s;
  return std::to_string(std::lround(1e3 * std::abs(lag_s))) + " ms " + (clamped ? "or more " : "") +
         (lag_s > 0 ? "later" : "earlier");
}

}  // namespace

TimeSkew take_off_skew(const MachineDescription& machine, IdentifyData& data) {
  const double lag_s = estimation::pressure_lag_s(machine, data.training).value_or(0);
  for (const Recording& recording : data.training) {
    if (data.training.size() == 1 || recording.duration_s() < kTellsAlone_s) continue;
    const double alone_s = estimation::pressure_lag_s(machine, {recording}).value_or(lag_s);
    if (std::abs(alone_s - lag_s) > kInStep_s)
      return {recording.source + ": pressures come " + later(alone_s) + " than lengths, in all recordings together " +
                  later(lag_s) + ": not sampled by one clock",
              true};
  }
  if (std::abs(lag_s) <= kInStep_s) return {};
  const std::string what = "pressures come " + later(lag_s) + " than lengths";
  if (std::abs(lag_s) > kMostTakenOff_s)
    return {what + "; at most " + std::to_string(std::lround(1e3 * kMostTakenOff_s)) + " ms can be corrected", true};
  for (std::vector<Recording>* recordings : {&data.training, &data.hold_out}) {
    for (Recording& recording : *recordings) recording = estimation::without_pressure_lag(recording, lag_s);
  }
  return {what + ": corrected", false};
}

}  // namespace knuckle::identify
