// Hammerstein model of one axis: a curve of the lever, then delay and lag.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "app/studies/wheel_loader.h"
#include "core/error.h"

namespace knuckle::studies {
namespace {

constexpr int kHats = 20;  ///< The lever's range is cut into so many parts; a curve is straight between their ends.
constexpr double kMoved = 0.02;        ///< Lever out of zero.
constexpr double kAfter_s = 0.5;       ///< How long after the lever's use a sample counts.
constexpr double kTilts_radps = 0.35;  ///< Faster than what lifting alone turns of the bucket's linkage.
constexpr double kEnd_rad = 0.04;      ///< Of the range seen.
constexpr double kLongestDelay_s = 0.6;
constexpr std::array kLags_s{0.02, 0.05, 0.08, 0.12, 0.16, 0.2, 0.25, 0.3, 0.4, 0.5, 0.7};
constexpr double kGrid = 0.02, kLeastSlope = 0.1;  ///< Of the lever: steps of the search, dead band to saturation.
constexpr std::size_t kLeastSamples = 200;
using Curve = Eigen::Matrix<double, kHats, 1>;

/// Share of each knot, but the first, in a lever between two of them.
Curve hats(double lever) {
  const double at = std::clamp(lever, 0.0, 1.0) * kHats;
  const int below = std::min(kHats - 1, static_cast<int>(at));
  Curve result = Curve::Zero();
  result[below] = at - below;
  if (below > 0) result[below - 1] = 1 - (at - below);
  return result;
}

/// Zero in the dead band, one in saturation, straight between.
Curve shape(double dead_band, double saturation) {
  Curve result;
  for (int i = 0; i < kHats; ++i) {
    result[i] = std::clamp(((i + 1.0) / kHats - dead_band) / (saturation - dead_band), 0.0, 1.0);
  }
  return result;
}

/// Samples that the axis's own lever explains: it was used shortly before, and nothing else stops or drives the motion.
/// While the bucket tilts, by its lever or (dumping, return to dig) by what the file does not hold, the lift gets what
/// flow is left; at the ends of the ranges it stands.
std::vector<std::size_t> explained_samples(const LoaderRun& run, std::size_t axis) {
  const auto [lowest, highest] = std::minmax_element(run.angle_rad[axis].begin(), run.angle_rad[axis].end());
  const auto after = static_cast<std::size_t>(kAfter_s / run.step_s);
  std::vector<std::size_t> result;
  std::size_t own = run.size(), tilting = run.size();  // samples since
  for (std::size_t i = 0; i < run.size(); ++i) {
    const double angle = run.angle_rad[axis][i];
    const bool at_end = angle < *lowest + kEnd_rad || angle > *highest - kEnd_rad;
    own = run.lever[axis][i] > kMoved ? 0 : own + 1;
    tilting = run.lever[kTilt][i] > kMoved || std::abs(run.speed_radps[kTilt][i]) > kTilts_radps ? 0 : tilting + 1;
    const bool alone = axis == kTilt || tilting > after;
    if (own <= after && alone && !at_end) result.push_back(i);
  }
  return result;
}

/// What delay and lag make of the curve's parts, with the speeds and forces that belong to them.
struct Lagged {
  std::vector<Curve> parts;
  std::vector<double> speed_radps, force_MN;
};

Lagged lagged(std::span<const LoaderRun> runs, std::size_t axis, double delay_s, double lag_s) {
  Lagged result;
  for (const LoaderRun& run : runs) {
    const auto delay = static_cast<std::size_t>(std::lround(delay_s / run.step_s));
    const double keep = std::exp(-run.step_s / lag_s);
    std::vector<Curve> parts(run.size());
    Curve state = Curve::Zero();
    for (std::size_t i = 0; i < run.size(); ++i) {
      state = keep * state + (1 - keep) * hats(run.lever[axis][i > delay ? i - delay : 0]);
      parts[i] = state;
    }
    for (const std::size_t i : explained_samples(run, axis)) {
      result.parts.push_back(parts[i]);
      result.speed_radps.push_back(run.speed_radps[axis][i]);
      result.force_MN.push_back(run.force_MN[axis][i]);
    }
  }
  return result;
}

struct CurveFit {
  double dead_band = 0, saturation = 1, full_radps = 0;
  double squares = std::numeric_limits<double>::infinity();
  [[nodiscard]] Curve curve() const { return full_radps * shape(dead_band, saturation); }
};

/// The best of all dead bands and saturations, each with its own best speed.
CurveFit fit_curve(const Lagged& data) {
  Eigen::Matrix<double, kHats, kHats> normal = Eigen::Matrix<double, kHats, kHats>::Zero();
  Curve right = Curve::Zero();
  double squares = 0;
  for (std::size_t i = 0; i < data.parts.size(); ++i) {
    normal += data.parts[i] * data.parts[i].transpose();
    right += data.parts[i] * data.speed_radps[i];
    squares += data.speed_radps[i] * data.speed_radps[i];
  }
  CurveFit best;
  for (int from = 0; from * kGrid + kLeastSlope <= 1; ++from) {
    for (double to = from * kGrid + kLeastSlope; to < 1 + kGrid / 2; to += kGrid) {
      const Curve unit = shape(from * kGrid, to);
      const double power = unit.dot(normal * unit), product = unit.dot(right);
      if (!(power > 0)) continue;
      const CurveFit candidate{from * kGrid, std::min(1.0, to), product / power, squares - product * product / power};
      if (candidate.squares < best.squares) best = candidate;
    }
  }
  return best;
}

}  // namespace

LoaderValve identify_loader_valve(std::span<const LoaderRun> train, std::span<const LoaderRun> test, LoaderAxis axis) {
  LoaderValve valve;
  CurveFit best;
  const double step_s = train.front().step_s;
  for (int delay = 0; delay * step_s <= kLongestDelay_s; ++delay) {
    for (const double lag_s : kLags_s) {
      const Lagged data = lagged(train, axis, delay * step_s, lag_s);
      if (data.parts.size() < kLeastSamples) {
        throw InputError(train.front().source + ": the " + kLoaderAxisNames[axis] + " lever is used in " +
                         std::to_string(data.parts.size()) + " samples, at least " + std::to_string(kLeastSamples) +
                         " are needed");
      }
      const CurveFit candidate = fit_curve(data);
      if (candidate.squares >= best.squares) continue;
      best = candidate;
      valve.delay_s = delay * step_s;
      valve.lag_s = lag_s;
    }
  }
  valve.full_radps = best.full_radps;
  valve.dead_band = best.dead_band;
  valve.saturation = best.saturation;
  const Curve curve = best.curve();

  // Load: what is left over, against the modelled speed times the force beyond its mean.
  const Lagged data = lagged(train, axis, valve.delay_s, valve.lag_s);
  double mean_MN = 0;
  for (const double force : data.force_MN) mean_MN += force / static_cast<double>(data.force_MN.size());
  double product = 0, squares = 1e-12;
  for (std::size_t i = 0; i < data.parts.size(); ++i) {
    const double modelled = data.parts[i].dot(curve), load = modelled * (data.force_MN[i] - mean_MN);
    product += load * (data.speed_radps[i] - modelled);
    squares += load * load;
  }
  valve.full_per_MN = product / squares;

  const Lagged held_out = lagged(test, axis, valve.delay_s, valve.lag_s);
  double error = 0, total = 0, mean_radps = 0;
  for (const double speed : held_out.speed_radps)
    mean_radps += speed / static_cast<double>(held_out.speed_radps.size());
  for (std::size_t i = 0; i < held_out.parts.size(); ++i) {
    const double modelled = held_out.parts[i].dot(curve) * (1 + valve.full_per_MN * (held_out.force_MN[i] - mean_MN));
    error += std::pow(held_out.speed_radps[i] - modelled, 2);
    total += std::pow(held_out.speed_radps[i] - mean_radps, 2);
  }
  valve.explained = total > 0 ? 1 - error / total : 0;
  return valve;
}

}  // namespace knuckle::studies
