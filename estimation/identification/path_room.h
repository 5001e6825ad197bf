// The room that designed motions keep to: a little inside of everything that check_path holds them to.
#pragma once

#include <random>

#include "core/joints.h"
#include "core/seed.h"
#include "estimation/identification/path_check.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

struct PathRoom {
  /// The widest window of joint ranges that is clear of the virtual walls in all its poses: the whole working range
  /// where nothing is in the way, else a share of it, also with the boom higher or lower and the arm folded.
  /// @throws InputError where a third of the ranges has no such place.
  explicit PathRoom(const MachineDescription& machine);

  JointVector low_rad, high_rad;
  JointVector rate_radps;
  double flow_m3ps, tip_speed_mps, tip_mps2;

  /// Largest of peak over limit of all that falls with the speed of a motion: joint rates, flow, tip speed; and
  /// `fastest_mps` at any cylinder.
  [[nodiscard]] double speed_use(const PathExtremes& extremes, double fastest_mps) const;
};

using PathRandom = std::mt19937_64;
/// Uniform in [low, high).
[[nodiscard]] inline double uniform(PathRandom& random, double low, double high) {
  return low + (high - low) * unit_interval(random);
}

}  // namespace knuckle::estimation
