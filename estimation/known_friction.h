// Friction of a cylinder as identified, or as drawn where it was not.
#pragma once

#include "estimation/friction.h"
#include "machine/description.h"

namespace knuckle::estimation {

[[nodiscard]] inline CylinderFriction known_friction(const MachineDescription& machine, int joint) {
  return machine.dynamics_calibration ? CylinderFriction(machine.dynamics_calibration->friction(joint))
                                      : CylinderFriction(machine.cylinders[static_cast<std::size_t>(joint)].friction);
}

}  // namespace knuckle::estimation
