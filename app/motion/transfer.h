// A gentle way from pose to pose.
#pragma once

#include "core/joints.h"
#include "estimation/identification/excitation.h"
#include "machine/description_fwd.h"
#include "machine/kinematics.h"

namespace knuckle::motion {

/// All joints together along a quintic, at rest at both ends, slow enough for every joint, the pump and the tip to keep
/// well below what they can do.
[[nodiscard]] estimation::JointPath transfer(const MachineDescription& machine, const Kinematics& kinematics,
                                             const JointVector& from_rad, const JointVector& to_rad, double step_s);

}  // namespace knuckle::motion
