// Which haptic device goes with a machine, and whether the two make one spring.
#pragma once

#include <string>

#include "machine/description_fwd.h"
#include "machine/device_description.h"

namespace knuckle {

/// @param asked name or .toml file; empty: the device made for this machine where there is one, else knuckle1.
/// @throws InputError as load_device() does.
[[nodiscard]] DeviceDescription device_for(const MachineDescription& machine, const std::string& asked);

/// Hand and machine must be one spring, or what is held is not what is felt: K_l = lambda mu Ks.
/// @throws InputError where they are not.
void check_springs(const MachineDescription& machine, const DeviceDescription& device);

}  // namespace knuckle
