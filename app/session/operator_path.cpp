#include "app/session/operator_path.h"

#include <fmt/format.h>
#include <math.h>  // Boost 1.74's pchip calls isnan unqualified

#include <algorithm>
#include <array>
#include <boost/math/interpolators/pchip.hpp>
#include <cmath>
#include <numbers>
#include <utility>

#include "app/recordings/csv_reader.h"
#include "app/recordings/own_table.h"
#include "core/error.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::session {
namespace {

using Curve = boost::math::interpolators::pchip<std::vector<double>>;
using Notes = std::vector<std::string>;

constexpr std::size_t kLeastKnots = 4;    // of a cubic
constexpr std::size_t kRowsInNotes = 40;  // stretches of rows named
constexpr double kUnchanged_s = 0.3;      // equal values seen for longer are a standstill, for less a late refresh
constexpr double kLongestGap_s = 5;       // the motion in a longer gap is unknown: it is shortened
constexpr double kEase_s = 0.5;           // a hand starts and ends at rest
constexpr double kLeastEase = 0.05;       // of recorded speed, so that the end is reached
constexpr double kStep_s = 1e-3;
constexpr double kLongestPath_s = 1800;

double degrees(double rad) {
  return rad * 180 / std::numbers::pi;
}

/// Usable values of one joint over time.
struct Knots {
  std::vector<double> t, value;
  std::vector<std::size_t> late_rows;  // left out: they only repeat a late refresh
  void add(double time_s, double v) {
    t.push_back(time_s);
    value.push_back(v);
  }
};

/// Plays gaps beyond kLongestGap_s in that time.
void close_long_gaps(recordings::MappedTable& table, Notes& notes) {
  double removed = 0;
  double before = table.until_s.front();
  for (std::size_t i = 1; i < table.time_s.size(); ++i) {
    const double gap = table.time_s[i] - before;
    before = table.until_s[i];
    if (gap > std::max(kLongestGap_s, table.gap_s)) {
      removed += gap - kLongestGap_s;
      notes.push_back(
          fmt::format("gap of {:.1f} s before row {}: played in {:.0f} s", gap, table.rows[i], kLongestGap_s));
    }
    table.time_s[i] -= removed;
    table.until_s[i] -= removed;
  }
}

/// For how long rows first...last were seen to report what they report, gaps not counted.
double seen_s(const recordings::MappedTable& table, std::size_t first, std::size_t last) {
  double seen = 0;
  for (std::size_t i = first; i <= last; ++i) {
    seen += table.until_s[i] - table.time_s[i];
    const double step = i < last ? table.time_s[i + 1] - table.until_s[i] : 0.0;
    if (step <= table.gap_s) seen += step;
  }
  return seen;
}

/// Knots of one joint: of equal values that follow one another only the first, unless they are a standstill.
Knots usable(const recordings::MappedTable& table, const std::vector<double>& values) {
  Knots knots;
  for (std::size_t first = 0, next; first < values.size(); first = next) {
    next = first + 1;
    if (!std::isfinite(values[first])) continue;
    while (next < values.size() && values[next] == values[first]) ++next;
    const std::size_t last = next - 1;
    const bool ends = next == values.size();
    const bool standstill = seen_s(table, first, last) > kUnchanged_s;
    knots.add(table.time_s[first], values[first]);
    for (std::size_t i = first + 1; i <= last; ++i) {
      if (standstill) {
        knots.add(table.time_s[i], values[i]);
      } else {
        knots.late_rows.push_back(table.rows[i]);
      }
    }
    const double held_s = ends ? std::max(table.until_s[last], table.time_s[last]) : table.until_s[last];
    if ((standstill || ends) && held_s > knots.t.back()) knots.add(held_s, values[last]);
  }
  return knots;
}

/// Angles beyond the machine's range are scaled linearly about mid-range.
void fit_range(Knots& knots, const LinkDescription& link, const char* joint, Notes& notes) {
  const double low = link.min_rad + kPathRangeMargin_rad, high = link.max_rad - kPathRangeMargin_rad;
  const double mid = (low + high) / 2;
  const auto [least, most] = std::minmax_element(knots.value.begin(), knots.value.end());
  const double reach = std::max(mid - *least, *most - mid);
  if (reach <= (high - low) / 2) return;
  const double scale = (high - low) / 2 / reach;
  notes.push_back(fmt::format(
      "{}: recorded {:.1f} to {:.1f} deg, scaled by {:.3f} about {:.1f} deg to stay inside {:.1f} to {:.1f} deg", joint,
      degrees(*least), degrees(*most), scale, degrees(mid), degrees(low), degrees(high)));
  for (double& v : knots.value) v = mid + scale * (v - mid);
}

struct Motion {
  std::vector<Curve> curves;
  double begin_s, end_s;
};

Motion read_motion(const recordings::MappedTable& table, const MachineDescription& machine, Notes& notes) {
  static constexpr std::array kChannels{"boom_rad", "arm_rad", "bucket_rad"};
  Motion motion{{}, table.time_s.front(), table.until_s.back()};
  for (std::size_t i = 0; i < kJoints; ++i) {
    Knots knots = usable(table, table.channel(kChannels[i]).values);
    if (knots.t.size() < kLeastKnots) {
      table.refuse(std::string("channel '") + kChannels[i] + "' has " + std::to_string(knots.t.size()) +
                   " usable values, at least " + std::to_string(kLeastKnots) + " are needed");
    }
    if (!knots.late_rows.empty()) {
      notes.push_back(fmt::format("{}: {} x late refresh (left out): row ", kJointNames[i], knots.late_rows.size()) +
                      recordings::row_list(knots.late_rows, kRowsInNotes));
    }
    fit_range(knots, machine.links[i], kJointNames[i], notes);
    motion.begin_s = std::max(motion.begin_s, knots.t.front());
    motion.end_s = std::min(motion.end_s, knots.t.back());
    motion.curves.emplace_back(std::move(knots.t), std::move(knots.value));
  }
  if (motion.end_s <= motion.begin_s) table.refuse("there is no time with usable values of all joints");
  const double unknown_s = table.until_s.back() - table.time_s.front() - (motion.end_s - motion.begin_s);
  if (unknown_s > 0) {
    notes.push_back(fmt::format("{:.1f} s at the start or end left out: not every joint has values there", unknown_s));
  }
  return motion;
}

/// What makes time stretch: the joints' speeds, then these.
enum SlowedBy : std::size_t { kPump = kJoints, kTip, kEase, kCauses };
constexpr std::array kCauseNames{"boom speed", "arm speed", "bucket speed", "pump flow", "tip speed", "start and end"};
static_assert(kCauseNames.size() == kCauses);

/// How many times its share of each limit the machine is asked for.
std::array<double, kEase> demands(const MachineDescription& machine, const Kinematics& kinematics, const JointVector& q,
                                  const JointVector& rate) {
  std::array<double, kEase> demand{};
  double flow = 0;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto j = static_cast<Eigen::Index>(i);
    demand[i] = std::abs(rate[j]) / (kPathSpeedShare * machine.links[i].max_rate_radps);
    const auto cylinder = kinematics.cylinder_at(static_cast<int>(i), q[j]);
    const double v = cylinder ? cylinder->lever_m * rate[j] : 0.0;
    flow += v > 0 ? v * machine.cylinders[i].head_area_m2() : -v * machine.cylinders[i].rod_side_area_m2();
  }
  demand[kPump] = flow / (kPathSpeedShare * machine.hydraulics.pump_flow_m3ps);
  demand[kTip] = (kinematics.tip_jacobian(q) * rate).norm() / (kPathSpeedShare * machine.limits.tip_speed_mps);
  return demand;
}

/// Walks along the motion in steps of played time, each as far in recorded time as the machine and a hand allow.
class Player {
 public:
  Player(const Motion& motion, const MachineDescription& machine)
      : motion_(motion), machine_(machine), kinematics_(machine) {}

  void play(OperatorPath& path) {
    constexpr std::size_t kStepsPerPoint = static_cast<std::size_t>(kPathPeriod / 1ms);
    static_assert(kPathPeriod == kStepsPerPoint * 1ms);
    std::size_t steps = 0;
    double t = motion_.begin_s;
    for (; t < motion_.end_s; ++steps) {
      const double played_s = kStep_s * static_cast<double>(steps);
      if (played_s > kLongestPath_s) {
        throw InputError(fmt::format("the motion plays longer than {:.0f} s: cut the file", kLongestPath_s));
      }
      const sim::PathPoint recorded = point_at(t);
      const double speed = speed_at(recorded, t, played_s);
      if (steps % kStepsPerPoint == 0) path.points.push_back({recorded.joints_rad, speed * recorded.rates_radps});
      t += kStep_s * speed;
    }
    path.points.push_back({point_at(motion_.end_s).joints_rad, JointVector::Zero()});
    path.played_s = kStep_s * static_cast<double>(steps);
  }

  [[nodiscard]] std::string note(const OperatorPath& path) const {
    std::string text = fmt::format("recorded in {:.1f} s, played in {:.1f} s", path.recorded_s, path.played_s);
    const char* separator = ": ";
    for (std::size_t c = 0; c < kCauses; ++c) {
      if (added_s_[c] < 0.05) continue;
      text += separator + fmt::format("{:+.1f} s for {}", added_s_[c], kCauseNames[c]);
      if (c != kEase) text += fmt::format(" (at most {:.1f}-fold)", most_[c]);
      separator = ", ";
    }
    return text;
  }

 private:
  [[nodiscard]] sim::PathPoint point_at(double t) const {
    sim::PathPoint point;
    for (std::size_t i = 0; i < kJoints; ++i) {
      point.joints_rad[static_cast<Eigen::Index>(i)] = motion_.curves[i](t);
      point.rates_radps[static_cast<Eigen::Index>(i)] = motion_.curves[i].prime(t);
    }
    return point;
  }

  /// How many times its share of a limit is asked for at a recorded time, and of which.
  [[nodiscard]] std::pair<double, SlowedBy> worst_at(const sim::PathPoint& point) const {
    const auto demand = demands(machine_, kinematics_, point.joints_rad, point.rates_radps);
    const auto worst = std::max_element(demand.begin(), demand.end());
    return {*worst, static_cast<SlowedBy>(worst - demand.begin())};
  }

  /// Recorded seconds a played second: what is asked for at both ends of a step must be within limits.
  double speed_at(const sim::PathPoint& point, double t, double played_s) {
    const double left_s = motion_.end_s - t;
    const double ease = std::clamp(std::min(played_s / kEase_s, std::sqrt(2 * left_s / kEase_s)), kLeastEase, 1.0);
    auto worst = worst_at(point);
    const double next = t + kStep_s * ease / std::max(1.0, worst.first);
    worst = std::max(worst, worst_at(point_at(std::min(next, motion_.end_s))));
    const double allowed = 1 / std::max(1.0, worst.first);
    added_s_[worst.second] += kStep_s * (1 - allowed);
    most_[worst.second] = std::max(most_[worst.second], worst.first);
    added_s_[kEase] += kStep_s * allowed * (1 - ease);
    return allowed * ease;
  }

  const Motion& motion_;
  const MachineDescription& machine_;
  Kinematics kinematics_;
  std::array<double, kCauses> added_s_{}, most_{};
};

}  // namespace

OperatorPath load_operator_path(const std::vector<std::string>& files, const std::string& map_path,
                                const MachineDescription& machine) {
  recordings::MappedTable table = recordings::is_recording(files.front())
                                      ? recordings::table_of_recording(files, map_path)
                                      : recordings::read_mapped_csv(files.front(), map_path);
  OperatorPath path;
  path.notes = table.report();
  path.recorded_s = table.until_s.back();
  close_long_gaps(table, path.notes);
  const Motion motion = read_motion(table, machine, path.notes);
  Player player(motion, machine);
  player.play(path);
  path.notes.push_back(player.note(path));
  return path;
}

}  // namespace knuckle::session
