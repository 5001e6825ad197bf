// Whether a machine can be driven along a joint path: a guard before anything moves.
#pragma once

#include <string>
#include <vector>

#include "core/joints.h"
#include "estimation/identification/joint_path.h"
#include "machine/description_fwd.h"

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

}  // namespace knuckle::estimation
