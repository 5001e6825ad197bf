// Listens to a haptic device without commanding it: the identity request is all that is sent.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/bringup/doctor_finding.h"
#include "app/cli/options.h"
#include "core/joints.h"
#include "core/time.h"
#include "machine/device_description.h"
#include "transport/hid_device_port.h"
#include "transport/hid_reports.h"

namespace knuckle::bringup {

/// What was received while listening.
struct DeviceListening {
  double spanned_s = 0;  ///< From the first report to the newest, by the device's own clock.
  std::uint64_t reports = 0, damaged = 0;
  std::uint64_t missed = 0;                    ///< By the sequence numbers.
  double longest_gap_ms = 0;                   ///< Between two reports, by the device's own clock.
  DeviceState newest;                          ///< Of `reports` > 0.
  std::uint16_t status_seen = 0;               ///< Every status bit that was set at any time.
  PerJoint<std::int32_t> lowest{}, highest{};  ///< Counts.
};

class DeviceProbe {
 public:
  /// @param port outlives this. @param wait lets time go by; a test moves its simulated device meanwhile.
  DeviceProbe(HidPort& port, std::function<void(Duration)> wait);

  /// Repeats the request until it is answered. nullopt after `patience`: no device, or one that does not answer.
  [[nodiscard]] std::optional<DeviceIdentity> identity(Duration patience);
  [[nodiscard]] DeviceListening listen(Duration length);

 private:
  HidPort& port_;
  std::function<void(Duration)> wait_;
};

/// Options --serial and --usb-port of a command.
void add_device_choice(const cli::OptionList& command, HidChoice& choice);
/// @throws InputError where a device was chosen although none is used, with what it would go with.
void check_no_device_choice(const HidChoice& choice, const char* goes_with);

/// The back ends by name.
inline constexpr const char* kDeviceBackEnds = "hid, usb";
/// @param back_end "hid" or "usb". @throws InputError for others, naming `option`.
[[nodiscard]] std::unique_ptr<HidDevicePort> open_device_port(const std::string& option, const std::string& back_end,
                                                              const HidDeviceOptions& options);
/// The device that leads a machine, read with more urgency than the loop has which waits for its reports.
/// @return nullptr where the back end is neither "hid" nor "usb": none, or a keyboard.
[[nodiscard]] std::unique_ptr<HidDevicePort> open_leading_device(const std::string& back_end, const HidChoice& choice);
/// The devices that back end can see.
[[nodiscard]] std::vector<HidCandidate> list_devices(const std::string& back_end);

/// Differences between the device and its file: one line each, such as "wrist: gear ratio 12, file 15".
[[nodiscard]] std::vector<std::string> differences(const DeviceIdentity& identity, const DeviceDescription& file);

// The checks of `knuckle doctor --device` on a haptic device. Only reads; the motors are not commanded.

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
