// `knuckle bus add`: puts a device that is sold, described by its vendor's EDS, into a machine file. `knuckle bus
// import`, `assign-id`, `migrate`: see dbc_import.h, assign_id.h, migrate.h.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/cli/command.h"
#include "app/eds/device_file.h"
#include "machine/description.h"

namespace knuckle::eds {

/// The profile as [[bus.node]] tables call it: "cia408/pved".
[[nodiscard]] std::string profile_name(const NodeDescription& node);

/// By its name, or that of a signal it has. @throws InputError where there is none, which names those that there are.
[[nodiscard]] const NodeDescription& named_node(const BusDescription& bus, const std::string& name,
                                                const std::string& source);

/// A changed machine file's text as programs will read it. @param with what is new in it.
/// @throws InputError where it is none: in one line, without places in a text that nobody has.
[[nodiscard]] MachineDescription parse_changed(const std::string& text, const std::string& source,
                                               const std::string& with);

/// The machine file's text with the device in place of that node, its comments and order as they were. An older file
/// has its nodes in tables then (with_node_tables()).
/// @param node name of a node of the machine file, or of a signal that one has. @throws InputError where the device's
/// profile is not that node's, where the file has not each key of the node on a line of its own, or where the result is
/// no machine file (an id that is taken, say).
[[nodiscard]] std::string with_device(const std::string& machine_text, const std::string& machine_source,
                                      const std::string& node, std::uint8_t id, const DeviceFile& device);

/// How a device fits the start-up of its node, one line each.
struct Fit {
  std::vector<std::string> obstacles;  ///< Start-up would fail.
  std::vector<std::string> notes;      ///< A guard that start-up could not set beside one that it can.
  std::vector<std::string> to_set;     ///< Start-up asks for a value that the device does not have as delivered.
};
/// @throws InputError where the machine has no node of that name.
[[nodiscard]] Fit fit_of(const DeviceFile& device, const MachineDescription& machine, const std::string& node);

[[nodiscard]] cli::Command bus_entry();

}  // namespace knuckle::eds
