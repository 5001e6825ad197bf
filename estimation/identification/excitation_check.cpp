#include "estimation/identification/excitation_check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>

namespace knuckle::estimation {
namespace {

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void add(double value) noexcept {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  [[nodiscard]] double width() const noexcept { return high > low ? high - low : 0; }
};

std::string number(double value, int digits) {
  std::ostringstream text;
  text.setf(std::ios::fixed);
  text.precision(digits);
  text << value;
  return text.str();
}

std::string channel(std::size_t k) {
  return std::string(kJointNames[k / 2]) + (k % 2 == 0 ? " head" : " rod") + " pressure";
}

void check_pressures(std::span<const Recording> recordings, const ExcitationLimits& limits,
                     std::vector<std::string>& faults) {
  std::array<Range, 6> ranges{};
  for (const Recording& recording : recordings) {
    for (std::size_t i = 0; i < recording.samples.size(); ++i) {
      for (std::size_t k = 0; k < 6 && recording.usable[i] != 0; ++k)
        ranges[k].add(recording.samples[i].pressure_Pa[k]);
    }
  }
  const auto dead = [&](const Range& r) { return r.high < limits.least_pressure_Pa; };
  if (std::all_of(ranges.begin(), ranges.end(), dead)) {
    faults.push_back("all pressures are below " + number(limits.least_pressure_Pa / 1e5, 0) +
                     " bar throughout: no transmitter is connected, or the unit is wrong");
    return;
  }
  for (std::size_t k = 0; k < 6; ++k) {
    if (ranges[k].width() == 0)
      faults.push_back(channel(k) + " never changes: " + number(ranges[k].high / 1e5, 1) + " bar");
  }
}

void check_joint(int joint, std::span<const Motion> motions, const ExcitationLimits& limits,
                 std::vector<std::string>& faults) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  const std::string name = kJointNames[static_cast<std::size_t>(joint)];
  Range angle;
  double extending_s = 0, retracting_s = 0;
  for (const Motion& motion : motions) {
    for (const Stretch& stretch : motion.stretches) {
      for (Eigen::Index n = stretch.first; n < stretch.end; ++n) {
        angle.add(motion.joint_rad(joint, n));
        if (motion.cylinder_mps(joint, n) > limits.moving_mps) extending_s += motion.step_s;
        if (motion.cylinder_mps(joint, n) < -limits.moving_mps) retracting_s += motion.step_s;
      }
    }
  }
  if (angle.width() < limits.least_travel_rad) {
    faults.push_back(name + " moves over " + number(kDegrees * angle.width(), 1) + " deg only, at least " +
                     number(kDegrees * limits.least_travel_rad, 1) + " deg are needed");
    return;
  }
  const auto one_way = [&](double time_s, const char* direction) {
    if (time_s >= limits.least_directed_s) return;
    faults.push_back(name + " cylinder " + direction + " for " + number(time_s, 1) + " s only, at least " +
                     number(limits.least_directed_s, 1) +
                     " s are needed: one direction alone does not separate friction from weight");
  };
  one_way(extending_s, "extends");
  one_way(retracting_s, "retracts");
}

}  // namespace

std::vector<std::string> excitation_faults(std::span<const Recording> recordings, std::span<const Motion> motions,
                                           const ExcitationLimits& limits) {
  std::vector<std::string> faults;
  double duration_s = 0;
  for (const Motion& motion : motions) duration_s += motion.duration_s();
  if (duration_s < limits.least_duration_s) {
    faults.push_back(number(duration_s, 1) + " s of usable data, at least " + number(limits.least_duration_s, 1) +
                     " s are needed");
  }
  if (duration_s <= 0) return faults;
  check_pressures(recordings, limits, faults);
  for (int joint = 0; joint < kJoints; ++joint) check_joint(joint, motions, limits, faults);
  return faults;
}

}  // namespace knuckle::estimation
