#include "estimation/identification/pressure_lag.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "estimation/identification/full.h"

namespace knuckle::estimation {
namespace {

constexpr double kShift_s = 0.05;  // between the shifts tried: within less the error hardly grows
constexpr double kStep_s = 0.02;   // coarse is enough and quick
constexpr double kCutoff_Hz = 2;
constexpr double kShortest_s = 20;  // less motion fits any shift

/// Share of the torque's variance that the model, identified anew, leaves; none where it cannot be solved for.
std::optional<double> unexplained(const MachineDescription& machine, const std::vector<Recording>& recordings) {
  FullOptions options;
  options.usual_errors = false;  // only parameters count
  const FullResult found = identify_full(machine, recordings, options);
  if (found.summary.parameters.empty()) return {};
  double left = 0;
  for (const Recording& recording : recordings) {
    const TorqueComparison comparison = compare_torque(found.dynamics, machine, recording);
    for (const double nrmse : torque_fit(comparison, kCutoff_Hz).nrmse) {
      if (std::isfinite(nrmse)) left += nrmse * nrmse * recording.duration_s();
    }
  }
  return left;
}

}  // namespace

Recording without_pressure_lag(const Recording& recording, double lag_s) {
  Recording result = recording;
  const double later = lag_s / recording.step_s, last = static_cast<double>(recording.samples.size()) - 1;
  for (std::size_t i = 0; i < result.samples.size(); ++i) {
    const double at = static_cast<double>(i) + later;
    if (at < 0 || at > last) {
      result.usable[i] = 0;
      continue;
    }
    const auto before = static_cast<std::size_t>(at);
    const std::size_t after = std::min(before + 1, recording.samples.size() - 1);
    const double share = at - static_cast<double>(before);
    for (std::size_t c = 0; c < result.samples[i].pressure_Pa.size(); ++c) {
      const double from = recording.samples[before].pressure_Pa[c], to = recording.samples[after].pressure_Pa[c];
      result.samples[i].pressure_Pa[c] = from + share * (to - from);
    }
    if (recording.usable[before] == 0 || recording.usable[after] == 0) result.usable[i] = 0;
  }
  return result;
}

std::optional<double> pressure_lag_s(const MachineDescription& machine, const std::vector<Recording>& recordings) {
  double duration_s = 0;
  for (const Recording& recording : recordings) duration_s += recording.duration_s();
  if (duration_s < kShortest_s) return {};
  const int most = static_cast<int>(std::lround(kMostPressureLag_s / kShift_s));
  std::map<int, double> left;  // by shift
  const auto at = [&](int shift) -> std::optional<double> {
    if (const auto known = left.find(shift); known != left.end()) return known->second;
    std::vector<Recording> tried;
    for (const Recording& recording : recordings) {
      const auto every = static_cast<std::size_t>(std::max(1.0, std::floor(kStep_s / recording.step_s)));
      tried.push_back(decimated(without_pressure_lag(recording, kShift_s * shift), every));
    }
    const auto found = unexplained(machine, tried);
    if (found) left[shift] = *found;
    return found;
  };
  // Downhill from no shift, then to the bottom of the parabola through the lowest and its neighbours.
  for (int shift = 0; std::abs(shift) <= most;) {
    const auto before = at(shift - 1), here = at(shift), after = at(shift + 1);
    if (!before || !here || !after) return {};
    if (*here <= *before && *here <= *after) {
      const double bend = *before - 2 * *here + *after;
      return kShift_s * (shift + (bend > 0 ? 0.5 * (*before - *after) / bend : 0));
    }
    const int next = shift + (*before < *after ? -1 : 1);
    if (std::abs(next) > most) {
      return std::copysign(kMostPressureLag_s, static_cast<double>(shift));
    }
    shift = next;
  }
  return {};
}

}  // namespace knuckle::estimation
