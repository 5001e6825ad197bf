// `knuckle bus add`: puts a device that is sold, described by its vendor's EDS, into a machine file.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/cli/command.h"
#include "app/eds/device_file.h"
#include "machine/description.h"

namespace knuckle::eds {

/// The machine file's text with the device in place of the node of that name, its comments and order as they were.
/// @param node a node of the machine file. @throws InputError where the device's profile is not that node's, where the
/// file does not have the node on one line in [bus.nodes], or where the result is no machine file (an id that is taken,
/// say).
[[nodiscard]] std::string with_device(const std::string& machine_text, const std::string& machine_source,
                                      const std::string& node, std::uint8_t id, const DeviceFile& device);

/// How a device fits the start-up of its node, one line each.
struct Fit {
  std::vector<std::string> obstacles;  ///< Start-up would fail.
  std::vector<std::string> to_set;     ///< Start-up asks for a value that the device does not have as delivered.
};
/// @throws InputError where the machine has no node of that name.
[[nodiscard]] Fit fit_of(const DeviceFile& device, const MachineDescription& machine, const std::string& node);

[[nodiscard]] cli::Command bus_entry();

}  // namespace knuckle::eds
