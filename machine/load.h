// Machine and device files into their descriptions: strict, complete and checked, or refused with one line.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "machine/description.h"
#include "machine/description_fwd.h"
#include "machine/device_description.h"

namespace knuckle {

/// Reads and checks a machine file. Everything is required but [calibration]; nothing has a silent default.
/// Of [commissioning] only the guards' proofs are read.
/// @throws InputError naming file, line, key, value and bound: unknown, missing or out-of-range keys, geometry that
/// does not reach or passes a toggle, node ids that clash, a bus that is too full, control constants out of bounds.
[[nodiscard]] MachineDescription load_machine(const std::string& path);
/// The same for text in memory; `source` names it in messages.
[[nodiscard]] MachineDescription parse_machine(std::string_view text, const std::string& source);

/// The machine with another contact model in its file's text, so that a recording of it says which one ran.
/// @param machine as loaded, not calibrated(). @param model as --contact-model names it. @throws InputError with that
/// option where it is no model, or one that the machine's sensors do not allow.
[[nodiscard]] MachineDescription with_contact_model(const MachineDescription& machine, std::string_view model);

/// The same for a haptic device file.
[[nodiscard]] DeviceDescription load_device(const std::string& path);
/// The same for text in memory, such as a recording's. Its law may be one that is no more: which one ran, the
/// recording's head says, and feel.law is the default one then.
[[nodiscard]] DeviceDescription parse_device(std::string_view text, const std::string& source);

/// Path of a configuration file: "solar015" of kind "machine" is <config dir>/machines/solar015.toml; anything with
/// a '/' or ending in ".toml" is a path and stays as it is. The directory is $KNUCKLE_CONFIG_DIR, else the one
/// installed with the running program (share/knuckle beside its bin), else the checkout's.
/// @throws InputError for an unknown name, listing the ones there are.
[[nodiscard]] std::string find_config(const std::string& kind, const std::string& name_or_path);

/// What the configuration directory has of a kind, sorted.
[[nodiscard]] std::vector<std::string> config_names(const std::string& kind);

/// Whether the configuration directory has a file of this name and kind.
[[nodiscard]] bool has_config(const std::string& kind, const std::string& name);

// Which haptic device goes with a machine, and whether the two make one spring.

/// @param asked name or .toml file; empty: the device made for this machine where there is one, else knuckle1.
/// @throws InputError as load_device() does.
[[nodiscard]] DeviceDescription device_for(const MachineDescription& machine, const std::string& asked);

/// Hand and machine must be one spring, or what is held is not what is felt: K_l = lambda mu Ks.
/// @throws InputError where they are not.
void check_springs(const MachineDescription& machine, const DeviceDescription& device);

// A machine's camera by its name.

/// nullptr where the machine's file does not know it.
[[nodiscard]] inline const CameraDescription* find_camera(const MachineDescription& machine,
                                                          std::string_view name) noexcept {
  for (const CameraDescription& camera : machine.cameras)
    if (camera.name == name) return &camera;
  return nullptr;
}

}  // namespace knuckle
