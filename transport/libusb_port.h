// The haptic device through libusb: asynchronous interrupt transfers, without the kernel's HID driver in between.
#pragma once

#include <vector>

#include "transport/hid_device_port.h"

namespace knuckle {

class LibusbPort final : public HidDevicePort {
 public:
  /// Returns at once; the device may be attached now, later, or never: see status(). While it is attached, the kernel's
  /// driver is detached from it (there is no /dev/hidraw then).
  explicit LibusbPort(const HidDeviceOptions& options = {});
};

/// The haptic devices that are attached now; the serial number of one that may not be opened is empty.
[[nodiscard]] std::vector<HidCandidate> libusb_devices();

}  // namespace knuckle
