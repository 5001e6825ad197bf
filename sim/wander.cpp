#include "sim/wander.h"

#include <algorithm>
#include <cmath>

#include "core/seed.h"
#include "sim/minimum_jerk.h"

namespace knuckle::sim {
namespace {

constexpr double kToAnEnd = 1.0 / 3;   // of stretches
constexpr double kSlowestShare = 0.2;  // of the fastest: speeds are drawn by ratio
constexpr double kLongestPause_s = 2;  // every other stretch has one
constexpr double kShortestStretch_s = 0.5;

}  // namespace

Wander::Wander(std::uint64_t seed, const JointVector& low_rad, const JointVector& high_rad)
    : random_(stream_seed(seed, Stream::kWander)), low_rad_(low_rad), high_rad_(high_rad) {}

void Wander::begin(const JointVector& from_rad, double fastest_radps) noexcept {
  fastest_radps_ = fastest_radps;
  meant_rad_ = from_rad;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const double angle = from_rad[static_cast<Eigen::Index>(i)];
    stretches_[i] = {angle, angle, 0, 0, 0};
  }
}

Wander::Stretch Wander::drawn(int joint, double from_rad, double t_s) noexcept {
  const double low = low_rad_[joint], high = high_rad_[joint];
  const double kind = unit_interval(random_), place = unit_interval(random_);
  const double to_rad = kind < kToAnEnd / 2 ? low : kind < kToAnEnd ? high : low + place * (high - low);
  const double peak_radps = fastest_radps_ * std::pow(kSlowestShare, unit_interval(random_));
  const double length_s = std::max(kShortestStretch_s, kPeakOfMinimumJerk * std::abs(to_rad - from_rad) / peak_radps);
  const double pause_s = kLongestPause_s * std::max(0.0, 2 * unit_interval(random_) - 1);
  return {from_rad, to_rad, t_s, t_s + length_s, t_s + length_s + pause_s};
}

const JointVector& Wander::step(double t_s, bool going_on) noexcept {
  at_rest_ = true;
  for (int joint = 0; joint < kJoints; ++joint) {
    Stretch& stretch = stretches_[static_cast<std::size_t>(joint)];
    if (going_on && t_s >= stretch.until_s) stretch = drawn(joint, stretch.to_rad, t_s);
    const double length_s = std::max(1e-9, stretch.end_s - stretch.begin_s);
    const double share = minimum_jerk((t_s - stretch.begin_s) / length_s);
    meant_rad_[joint] = stretch.from_rad + share * (stretch.to_rad - stretch.from_rad);
    at_rest_ = at_rest_ && t_s >= stretch.end_s;
  }
  return meant_rad_;
}

}  // namespace knuckle::sim
