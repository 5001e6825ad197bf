// Slow bidirectional sweeps, drawn in cylinder lengths.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/error.h"
#include "estimation/identification/excitation.h"
#include "estimation/identification/path_check.h"
#include "machine/description.h"

namespace knuckle::estimation {
namespace {

constexpr double kSweepStep_s = 0.005;
constexpr double kSlowestStroke_mps = 0.02, kFastestStroke_mps = 0.04;  ///< Of a cylinder; one speed a stroke.
constexpr std::uint64_t kSweepSeed = 1;
constexpr double kSweepRest_s = 1.0;  ///< At both ends.
constexpr double kRound_s = 0.4;      ///< Each of two boxes that round off the reversals.
constexpr double kShorter = 0.12;     ///< A stroke ends up to this share of the range before the range does.
constexpr double kRateShare = 0.35;   ///< Of a joint's rate limit: where a lever is short the joint would whip.
constexpr int kSweepCandidates = 24;
constexpr std::size_t kEvery = 40;  ///< Samples of 0.2 s tell the condition.

/// Largest cylinder speed that the joint's rate allows, by length.
class SpeedLimit {
 public:
  SpeedLimit(const Kinematics& kinematics, const PathRoom& room, int joint) {
    double previous = 0;
    for (int i = 0; i <= kPoints; ++i) {
      const double angle =
          room.low_rad[joint] + (room.high_rad[joint] - room.low_rad[joint]) * static_cast<double>(i) / kPoints;
      const CylinderState state = kinematics.cylinder_at(joint, angle).value();
      length_m_.push_back(state.length_m);
      speed_mps_.push_back(kRateShare * room.rate_radps[joint] * std::abs(state.lever_m));
      previous = state.length_m;
    }
    if (previous < length_m_.front()) {
      std::reverse(length_m_.begin(), length_m_.end());
      std::reverse(speed_mps_.begin(), speed_mps_.end());
    }
  }
  [[nodiscard]] double lowest_m() const { return length_m_.front(); }
  [[nodiscard]] double highest_m() const { return length_m_.back(); }
  /// Lengths are nearly even, but not quite: the smaller of two neighbours.
  [[nodiscard]] double at(double length_m) const {
    const auto above = std::upper_bound(length_m_.begin() + 1, length_m_.end() - 1, length_m);
    const auto i = static_cast<std::size_t>(above - length_m_.begin());
    return std::min(speed_mps_[i - 1], speed_mps_[i]);
  }

 private:
  static constexpr int kPoints = 100;
  std::vector<double> length_m_, speed_mps_;
};

/// Moving average of an odd number of samples, the ends held. Zero phase, and no value beyond what it averages.
std::vector<double> box(const std::vector<double>& values, std::size_t half) {
  std::vector<double> sums(values.size() + 2 * half + 1, 0);
  for (std::size_t i = 0; i + 1 < sums.size(); ++i) {
    const std::size_t at = i < half ? 0 : std::min(i - half, values.size() - 1);
    sums[i + 1] = sums[i] + values[at];
  }
  std::vector<double> result(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    result[i] = (sums[i + 2 * half + 1] - sums[i]) / static_cast<double>(2 * half + 1);
  }
  return result;
}

/// One cylinder's length over time: strokes to and fro at a steady speed each.
std::vector<double> strokes(const SpeedLimit& limit, double duration_s, PathRandom& random) {
  const double range = limit.highest_m() - limit.lowest_m();
  const auto samples = static_cast<std::size_t>(std::lround(duration_s / kSweepStep_s));
  const auto rest = static_cast<std::size_t>(std::lround((kSweepRest_s + kRound_s) / kSweepStep_s));
  double length = uniform(random, limit.lowest_m(), limit.highest_m());
  bool extends = uniform(random, 0, 1) < 0.5;
  double speed = 0, target = length;
  std::vector<double> result;
  result.reserve(samples);
  for (std::size_t i = 0; i < samples; ++i) {
    result.push_back(length);
    if (i < rest || i + rest >= samples) continue;
    if (speed == 0 || (extends ? length >= target : length <= target)) {
      extends = !extends;
      const double before = uniform(random, 0, kShorter) * range;
      target = extends ? limit.highest_m() - before : limit.lowest_m() + before;
      speed = uniform(random, kSlowestStroke_mps, kFastestStroke_mps);
    }
    const double step = std::min(speed, limit.at(length)) * kSweepStep_s;
    length = std::clamp(length + (extends ? step : -step), limit.lowest_m(), limit.highest_m());
  }
  const auto half = static_cast<std::size_t>(std::lround(kRound_s / kSweepStep_s / 2));
  return box(box(result, half), half);
}

struct Candidate {
  JointPath path;
  double condition = std::numeric_limits<double>::infinity();
};

}  // namespace

JointPath slow_sweeps(const MachineDescription& machine, double duration_s) {
  const PathRoom room(machine);
  const Kinematics kinematics(machine);
  const PathCondition condition(machine, false);
  PathRandom random(kSweepSeed);
  std::optional<Candidate> best;
  for (int tried = 0; tried < kSweepCandidates; ++tried) {
    Candidate candidate;
    candidate.path.step_s = kSweepStep_s;
    candidate.path.joint_rad.resize(static_cast<std::size_t>(std::lround(duration_s / kSweepStep_s)));
    for (int joint = 0; joint < kJoints; ++joint) {
      const std::vector<double> lengths = strokes(SpeedLimit(kinematics, room, joint), duration_s, random);
      for (std::size_t i = 0; i < lengths.size(); ++i) {
        candidate.path.joint_rad[i][joint] = kinematics.joint_at(joint, lengths[i]).value();
      }
    }
    candidate.condition = condition(candidate.path, kEvery);
    if (!best || candidate.condition < best->condition) best = std::move(candidate);
  }
  if (const auto violations = check_path(machine, best->path); !violations.empty()) {
    throw InputError(machine.source + ": sweeps cannot be driven: " + violations.front());
  }
  return std::move(best->path);
}

// Dig-like motion from point to point, for validation.

namespace {

constexpr double kStop_s = 0.4;      ///< At every point, and at both ends.
constexpr double kVariation = 0.09;  ///< Of a point, as share of the range each way.
constexpr double kGentle_s = 1.2;    ///< Least time of a move.

/// A digging cycle as shares of each joint's range: boom up, arm out, bucket open are 1.
const std::array<JointVector, 7> kCycle{{{0.50, 0.80, 0.75},    // reach out
                                         {0.22, 0.72, 0.62},    // lower
                                         {0.18, 0.45, 0.45},    // crawl
                                         {0.30, 0.20, 0.15},    // curl
                                         {0.78, 0.25, 0.12},    // lift
                                         {0.85, 0.60, 0.30},    // carry out
                                         {0.70, 0.65, 0.88}}};  // dump

/// From 0 to 1 over x in [0, 1]: steady speed between two smooth ramps, each `ramp` (at most 0.5) of the way.
double profile(double x, double ramp) {
  if (x > 0.5) return 1 - profile(1 - x, ramp);
  const double u = std::min(x / ramp, 1.0);
  return (ramp * u * u * u * (1 - u / 2) + std::max(0.0, x - ramp)) / (1 - ramp);
}

/// From where the path is to `to` over `samples` samples.
void append_move(JointPath& path, const JointVector& to, double ramp, std::size_t samples) {
  const JointVector from = path.joint_rad.back();
  for (std::size_t i = 1; i <= samples; ++i) {
    path.joint_rad.emplace_back(from +
                                profile(static_cast<double>(i) / static_cast<double>(samples), ramp) * (to - from));
  }
}

/// How long the move takes within the room's speeds: peaks of speed fall with the time, of acceleration with its
/// square.
std::size_t move_samples(const MachineDescription& machine, const PathRoom& room, const JointVector& from,
                         const JointVector& to, double ramp, double fastest_mps) {
  constexpr std::size_t kTrial = 200;
  JointPath trial{kSweepStep_s, {from}};
  append_move(trial, to, ramp, kTrial);
  const PathExtremes extremes = path_extremes(machine, trial, 2);
  const double stretch = std::max(room.speed_use(extremes, fastest_mps), std::sqrt(extremes.tip_mps2 / room.tip_mps2));
  return std::max(static_cast<std::size_t>(kGentle_s / kSweepStep_s),
                  static_cast<std::size_t>(std::ceil(kTrial * stretch)));
}

JointPath cycles(const MachineDescription& machine, const PathRoom& room, PathRandom& random, MotionSpeed speed,
                 double duration_s) {
  const auto samples = static_cast<std::size_t>(std::lround(duration_s / kSweepStep_s));
  const auto stop = static_cast<std::size_t>(kStop_s / kSweepStep_s);
  const auto point = [&](std::size_t i) {
    JointVector share = kCycle[i % kCycle.size()];
    for (int joint = 0; joint < kJoints; ++joint) {
      share[joint] = std::clamp(share[joint] + uniform(random, -kVariation, kVariation), 0.0, 1.0);
    }
    return JointVector(room.low_rad + share.cwiseProduct(room.high_rad - room.low_rad));
  };
  JointPath path{kSweepStep_s, {point(0)}};
  for (std::size_t i = 1; path.joint_rad.size() < samples; ++i) {
    path.joint_rad.insert(path.joint_rad.end(), stop, path.joint_rad.back());
    const double ramp = speed == MotionSpeed::kSlow ? 0.15 : 0.5;
    const double fastest_mps = speed == MotionSpeed::kSlow ? uniform(random, 0.02, 0.04) : uniform(random, 0.08, 0.12);
    const JointVector to = point(i);
    const std::size_t move = move_samples(machine, room, path.joint_rad.back(), to, ramp, fastest_mps);
    if (path.joint_rad.size() + move + stop > samples) {
      path.joint_rad.resize(samples, path.joint_rad.back());  // no time for another move: stands
      break;
    }
    append_move(path, to, ramp, move);
  }
  return path;
}

}  // namespace

JointPath held_out_motion(const MachineDescription& machine, std::uint64_t seed, MotionSpeed speed, double duration_s) {
  PathRandom random(seed);
  JointPath path = cycles(machine, PathRoom(machine), random, speed, duration_s);
  if (const auto violations = check_path(machine, path); !violations.empty()) {
    throw InputError(machine.source + ": digging cycle cannot be driven: " + violations.front());
  }
  return path;
}

}  // namespace knuckle::estimation
