#include "app/operator_path.h"

#include <math.h>  // Boost 1.74's pchip calls isnan unqualified

#include <algorithm>
#include <boost/math/interpolators/pchip.hpp>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "app/csv_reader.h"
#include "core/error.h"
#include "machine/kinematics.h"

namespace knuckle::app {
namespace {

using boost::math::interpolators::pchip;

constexpr double kSpeedShare = 0.7;        // of joint and pump limits: a hand does not lead the machine at its limit
constexpr double kRangeMargin_rad = 0.06;  // kept free at both ends of a joint's range
constexpr double kStandstill_s = 0.3;      // equal values for longer are a standstill, for less a late refresh

struct Knots {
  std::vector<double> t, value;
};

/// Usable knots of one channel: without unusable cells, and without values that only repeat a late refresh.
Knots usable(const MappedTable& table, const std::vector<double>& values, std::size_t& late) {
  Knots knots;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) continue;
    if (!knots.value.empty() && values[i] == knots.value.back()) {
      std::size_t run = i;
      while (run + 1 < values.size() && values[run + 1] == values[i]) ++run;
      const bool standstill = table.time_s[run] - knots.t.back() > kStandstill_s || run + 1 == values.size();
      if (!standstill) {
        late += run - i + 1;
        i = run;
        continue;
      }
    }
    knots.t.push_back(table.time_s[i]);
    knots.value.push_back(values[i]);
  }
  return knots;
}

/// Angles beyond the machine's range are scaled linearly about mid-range.
void fit_range(Knots& knots, const LinkDescription& link, const char* joint, std::vector<std::string>& notes) {
  const double low = link.min_rad + kRangeMargin_rad, high = link.max_rad - kRangeMargin_rad, mid = (low + high) / 2;
  double reach = 0;
  for (const double v : knots.value) reach = std::max(reach, std::abs(v - mid));
  const double scale = std::min(1.0, (high - low) / 2 / reach);
  if (scale == 1) return;
  for (double& v : knots.value) v = mid + scale * (v - mid);
  char line[160];
  std::snprintf(line, sizeof line, "%s: scaled by %.3f about %.1f deg to stay inside the machine's range", joint, scale,
                mid * 180 / std::numbers::pi);
  notes.emplace_back(line);
}

/// By how much time must be stretched here so that no joint and not the pump is asked for more than its share.
double stretch_at(const MachineDescription& machine, const Kinematics& kinematics, const JointVector& q,
                  const JointVector& rate) {
  double stretch = 1, flow = 0;
  for (int i = 0; i < kJoints; ++i) {
    const auto j = static_cast<std::size_t>(i);
    stretch = std::max(stretch, std::abs(rate[i]) / (kSpeedShare * machine.links[j].max_rate_radps));
    const auto cylinder = kinematics.cylinder_at(i, q[i]);
    const double v = cylinder ? cylinder->lever_m * rate[i] : 0.0;
    flow += v > 0 ? v * machine.cylinders[j].head_area_m2() : -v * machine.cylinders[j].rod_side_area_m2();
  }
  const double tip_mps = (kinematics.tip_jacobian(q) * rate).norm();
  return std::max({stretch, flow / (kSpeedShare * machine.hydraulics.pump_flow_m3ps),
                   tip_mps / (kSpeedShare * machine.limits.tip_speed_mps)});
}

}  // namespace

OperatorPath load_operator_path(const std::string& csv_path, const std::string& map_path,
                                const MachineDescription& machine) {
  const MappedTable table = read_mapped_csv(csv_path, map_path);
  OperatorPath path;
  path.notes.push_back(csv_path + ": " + table.summary());
  std::vector<pchip<std::vector<double>>> curves;
  std::size_t late = 0;
  double begin = table.time_s.front(), end = table.time_s.back();
  static constexpr const char* kChannels[] = {"boom_rad", "arm_rad", "bucket_rad"};
  for (std::size_t i = 0; i < kJoints; ++i) {
    Knots knots = usable(table, table.channel(kChannels[i]).values, late);
    if (knots.t.size() < 4)
      throw InputError(csv_path + ": channel '" + kChannels[i] + "' has fewer than 4 usable values");
    fit_range(knots, machine.links[i], kJointNames[i], path.notes);
    begin = std::max(begin, knots.t.front());
    end = std::min(end, knots.t.back());
    curves.emplace_back(std::move(knots.t), std::move(knots.value));
  }
  if (late > 0) path.notes.push_back(std::to_string(late) + " angle values only repeated a late refresh: left out");

  // Walk along recorded time; each step takes as long as the slowest of joints and pump needs.
  const Kinematics kinematics(machine);
  constexpr double kStep_s = 1e-3;
  const double period = to_seconds(kPathPeriod);
  double played = 0, longest = 1;
  for (double t = begin; t < end; t += kStep_s) {
    JointVector q, rate;
    for (int i = 0; i < kJoints; ++i) {
      q[i] = curves[static_cast<std::size_t>(i)](t);
      rate[i] = curves[static_cast<std::size_t>(i)].prime(t);
    }
    const double stretch = stretch_at(machine, kinematics, q, rate);
    longest = std::max(longest, stretch);
    if (played >= period * static_cast<double>(path.points.size())) path.points.push_back({q, rate / stretch});
    played += kStep_s * stretch;
    // A long stretch passes several grid points in one step: hold the pose for them.
    while (played >= period * static_cast<double>(path.points.size() + 1)) path.points.push_back({q, rate / stretch});
  }
  path.recorded_s = end - begin;
  path.played_s = played;
  char line[160];
  std::snprintf(line, sizeof line,
                "time stretched from %.1f s to %.1f s (at most %.2f-fold) to stay within joint and pump speed",
                path.recorded_s, path.played_s, longest);
  path.notes.emplace_back(line);
  return path;
}

}  // namespace knuckle::app
