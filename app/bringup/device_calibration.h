// Signs and zeros of a haptic device, found by moving each joint to its two stops: counts at the stops against the
// angles of the stops in the device's file.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "app/bringup/device_probe.h"
#include "app/cli/command.h"
#include "core/joints.h"
#include "machine/device_description.h"

namespace knuckle::bringup {

/// Counts with every joint at its lower (min_rad) and upper (max_rad) stop.
struct StopCounts {
  PerJoint<std::int32_t> low{}, high{};
};

/// The file's description, completed from the identity that the device reports and from its stops:
///   counts per radian  = gear ratio * counts per turn / 2 pi     (as reported by the device)
///   sign               = sign of (counts high - counts low)
///   zero               = mean over both stops of  counts - sign * counts per radian * angle of the stop
/// @param problem one line where the counts between the stops differ from their angles by more than 5 %.
[[nodiscard]] std::optional<DeviceDescription> calibrated_device(const DeviceDescription& file,
                                                                 const DeviceIdentity& identity,
                                                                 const StopCounts& stops, std::string& problem);

/// The device's file, comments included, with the calibrated values in place of the old ones.
/// @throws InputError where its [joints.*] tables do not have one key a line.
[[nodiscard]] std::string calibrated_device_text(std::string_view file_text, const DeviceDescription& device);

/// Texts to, and confirmations from, the person who calibrates.
struct CalibrationDialogue {
  std::function<void(const std::string& line)> say;
  /// Returns when the person has done what the line requests; false: cancelled.
  std::function<bool(const std::string& line)> ask;
};
/// Leads through six stops; the motors stay off. nullopt where it failed; the reason was written with say().
[[nodiscard]] std::optional<StopCounts> find_stops(DeviceProbe& probe, const DeviceIdentity& identity,
                                                   const CalibrationDialogue& person);

[[nodiscard]] cli::Command calibrate_device_entry();

}  // namespace knuckle::bringup
