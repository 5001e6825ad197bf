// The checks of `knuckle doctor --device` on a haptic device. Only reads; the motors are not commanded.
#pragma once

#include <string>

#include "app/bringup/device_probe.h"
#include "app/bringup/doctor_finding.h"
#include "machine/device_description.h"

namespace knuckle::bringup {

struct DeviceDoctorOptions {
  std::string back_end;             ///< "hid" or "usb"
  HidChoice choice;                 ///< Nothing: the only device there is.
  std::string device = "knuckle1";  ///< Name or .toml file that the device is compared with.
};

/// Looks for the device, opens it and examines it.
/// @throws InputError for another back end, or a device file that cannot be used.
[[nodiscard]] Findings doctor_device(const DeviceDoctorOptions& options);

/// Examines a device that is attached.
[[nodiscard]] Findings examine_device(DeviceProbe& probe, const DeviceDescription& file);

}  // namespace knuckle::bringup
