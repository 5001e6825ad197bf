// What a haptic device really is: the device file's values with the errors that motors, gears and assembly leave.
#pragma once

#include <cstdint>

#include "core/joints.h"
#include "machine/device_description.h"
#include "sim/truth.h"

namespace knuckle::sim {

struct DeviceTruth {
  DeviceTruth() = default;
  /// A device is as its file says unless something else is said.
  DeviceTruth(const DeviceDescription& description) : described(description), built(description) {}
  DeviceDescription described;                     ///< What its firmware reports: the file's values.
  DeviceDescription built;                         ///< What motors, gears and joints are.
  JointVector backlash_rad = JointVector::Zero();  ///< At the joints.
};

/// A smooth one is as its file says. Serviced: torque constants +-3 %, joints' zeros +-0.1 deg. Worn: +-10 %, +-0.5
/// deg, friction up to 5 times and cogging up to 3 times as large, backlash to 0.3 deg. Sources: sim/README.md.
[[nodiscard]] DeviceTruth sample_device(const DeviceDescription& nominal, Family family, std::uint64_t seed);

}  // namespace knuckle::sim
