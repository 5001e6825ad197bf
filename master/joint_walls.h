// Walls the hand feels where the machine's working range ends, per joint.
#pragma once

#include "core/joints.h"
#include "machine/description_fwd.h"
#include "machine/device_description.h"

namespace knuckle::master {

class JointWalls {
 public:
  /// The walls begin the machine's soft margin inside its range.
  JointWalls(const DeviceDescription& device, const MachineDescription& machine) noexcept;

  /// @param setpoint_rad not clamped to the range. @param setpoint_radps likewise.
  /// @return device joint torque [N m] pushing the set-point back inside.
  [[nodiscard]] JointVector torque(const JointVector& setpoint_rad, const JointVector& setpoint_radps) const noexcept;

 private:
  JointVector min_rad_, max_rad_, reach_m_;
  double limit_N_;
};

}  // namespace knuckle::master
