// How well a motion tells the parameters of the torque model apart.
#pragma once

#include "estimation/identification/joint_path.h"
#include "estimation/regressor.h"
#include "machine/description_fwd.h"
#include "machine/kinematics.h"

namespace knuckle::estimation {

class PathCondition {
 public:
  /// @param with_inertia nine base parameters; without, the six that gravity shows.
  PathCondition(const MachineDescription& machine, bool with_inertia);

  /// Condition number of the weighted, column-scaled regressor of joint torques along a path: base parameters, then per
  /// cylinder Coulomb friction each way and viscous friction. Rows are weighted with 1 / max(0.05 m, |lever|), as force
  /// noise reaches a torque through the lever. Infinite where a column is zero.
  /// @param every looks at the middle one of so many samples only; rates are central differences of the path's own
  /// step.
  [[nodiscard]] double operator()(const JointPath& path, std::size_t every) const;

 private:
  Kinematics kinematics_;
  RigidArm arm_;
  bool with_inertia_;
};

}  // namespace knuckle::estimation
