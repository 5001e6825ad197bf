// Whether a machine can be driven along a joint path: a guard before anything moves.
#pragma once

#include <random>
#include <string>
#include <vector>

#include "core/joints.h"
#include "core/seed.h"
#include "estimation/identification/excitation.h"
#include "estimation/regressor.h"
#include "machine/description_fwd.h"
#include "machine/kinematics.h"

namespace knuckle::estimation {

/// Most of the pump's flow that a path may ask for; the rest is left to the position control that follows it.
inline constexpr double kPathPumpShare = 0.85;

/// The largest of everything that is limited, over a path. Rates are central differences of the path.
struct PathExtremes {
  JointVector lowest_rad = JointVector::Zero(), highest_rad = JointVector::Zero();
  JointVector fastest_radps = JointVector::Zero();
  JointVector fastest_cylinder_mps = JointVector::Zero();
  double flow_m3ps = 0;  ///< sum |v_i| A_i, head side while extending, rod side while retracting
  double tip_speed_mps = 0;
  double tip_mps2 = 0;
  double lowest_tip_m = 0, highest_tip_m = 0, farthest_tip_m = 0;  ///< z, z, x in M.
};

/// @param every looks at the middle one of so many samples only.
/// @throws InputError where an angle is not finite or beyond what the linkage reaches.
[[nodiscard]] PathExtremes path_extremes(const MachineDescription& machine, const JointPath& path,
                                         std::size_t every = 1);

/// What the path violates, one line each with value, bound and time where it has one; empty: it can be driven.
/// Checked: a step and at least one second, finite angles, working range less the soft margin, joint rates, tip speed,
/// pump flow (kPathPumpShare), virtual walls, jumps, and rest at both ends.
[[nodiscard]] std::vector<std::string> check_path(const MachineDescription& machine, const JointPath& path);

// The room that designed motions keep to: a little inside of everything that check_path holds them to.

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

// How well a motion tells the parameters of the torque model apart.

class PathCondition {
 public:
  /// @param with_inertia nine base parameters; without, the six that gravity shows.
  PathCondition(const MachineDescription& machine, bool with_inertia);

  /// Condition number of the weighted, column-scaled regressor of joint torques along a path: base parameters, then per
  /// cylinder Coulomb friction each way and viscous friction. Rows are weighted with 1 / max(kLeastSureLever_m,
  /// |lever|), as force noise reaches a torque through the lever. Infinite where a column is zero.
  /// @param every looks at the middle one of so many samples only; rates are central differences of the path's own
  /// step.
  [[nodiscard]] double operator()(const JointPath& path, std::size_t every) const;

 private:
  Kinematics kinematics_;
  RigidArm arm_;
  bool with_inertia_;
};

}  // namespace knuckle::estimation
