// The haptic device through the kernel's hidraw driver (hidapi): no driver has to be detached, any user may open the
// device that the udev rule gives access to.
#pragma once

#include <vector>

#include "transport/hid_device_port.h"

namespace knuckle {

class HidapiPort final : public HidDevicePort {
 public:
  /// Returns at once; the device may be attached now, later, or never: see status().
  explicit HidapiPort(const HidDeviceOptions& options = {});
};

/// The haptic devices that are attached now, whether or not they may be opened.
[[nodiscard]] std::vector<HidCandidate> hidapi_devices();

}  // namespace knuckle
