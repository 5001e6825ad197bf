// How far machines of this kind yield behind their encoders: no drawing says it.
#pragma once

#include "core/joints.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

/// [rad/(N m)] Angle that each link stays behind its encoder per torque of its cylinder: one standard deviation.
/// Bending of boom, arm and bucket, and for the boom the ground under the tracks; larger machines yield less.
/// Sizes: sim/README.md, serviced machines.
[[nodiscard]] JointVector usual_compliance_radpNm(const MachineDescription& machine);

}  // namespace knuckle::estimation
