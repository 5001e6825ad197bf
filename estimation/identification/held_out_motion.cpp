// Dig-like motion from point to point, for validation.
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "estimation/identification/excitation.h"
#include "estimation/identification/path_room.h"
#include "machine/description.h"

namespace knuckle::estimation {
namespace {

constexpr double kStep_s = 0.005;
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
  JointPath trial{kStep_s, {from}};
  append_move(trial, to, ramp, kTrial);
  const PathExtremes extremes = path_extremes(machine, trial, 2);
  const double stretch = std::max(room.speed_use(extremes, fastest_mps), std::sqrt(extremes.tip_mps2 / room.tip_mps2));
  return std::max(static_cast<std::size_t>(kGentle_s / kStep_s), static_cast<std::size_t>(std::ceil(kTrial * stretch)));
}

JointPath cycles(const MachineDescription& machine, const PathRoom& room, PathRandom& random, MotionSpeed speed,
                 double duration_s) {
  const auto samples = static_cast<std::size_t>(std::lround(duration_s / kStep_s));
  const auto stop = static_cast<std::size_t>(kStop_s / kStep_s);
  const auto point = [&](std::size_t i) {
    JointVector share = kCycle[i % kCycle.size()];
    for (int joint = 0; joint < kJoints; ++joint) {
      share[joint] = std::clamp(share[joint] + uniform(random, -kVariation, kVariation), 0.0, 1.0);
    }
    return JointVector(room.low_rad + share.cwiseProduct(room.high_rad - room.low_rad));
  };
  JointPath path{kStep_s, {point(0)}};
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
