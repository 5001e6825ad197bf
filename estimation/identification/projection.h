// The nine base parameters that explain given torques best: what an identification is held against when the torques
// come from something that is not exactly such an arm (cylinders and linkage have mass, too).
#pragma once

#include <vector>

#include "core/joints.h"
#include "estimation/regressor.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

struct DynamicState {
  JointVector joint_rad = JointVector::Zero(), joint_radps = JointVector::Zero(), joint_radps2 = JointVector::Zero();
  double hull_pitch_rad = 0;
  JointVector lever_m = JointVector::Zero();   ///< For the weight 1 / max(0.05 m, |lever|), as `full` weighs.
  JointVector joint_Nm = JointVector::Zero();  ///< What moves the links: cylinder force less friction, times lever.
};

/// Weighted least squares over the samples in relative joints. @param machine gives the link lengths.
/// @throws std::invalid_argument where the samples do not determine all nine (rest).
[[nodiscard]] BaseParameters project(const MachineDescription& machine, const std::vector<DynamicState>& samples);

/// Weight of a joint's rows by its lever: sensor and friction errors live in the cylinder.
[[nodiscard]] inline double lever_weight(double lever_m) noexcept {
  const double arm = lever_m < 0 ? -lever_m : lever_m;
  return 1 / (arm > 0.05 ? arm : 0.05);
}

}  // namespace knuckle::estimation
