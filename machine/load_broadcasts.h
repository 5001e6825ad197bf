// [[bus.broadcast]] of a machine file: frames that the machine's own controller sends.
#pragma once

#include <vector>

#include "machine/bus_description.h"
#include "machine/description.h"
#include "machine/toml_reader.h"

namespace knuckle {

/// Notes what is wrong with them, each by itself and beside the others; what nodes have is not looked at.
/// @param bus its rates and limits.
[[nodiscard]] std::vector<BroadcastFrame> read_broadcasts(std::vector<TomlTable> files, const BusDescription& bus,
                                                          const SensorDescription& sensors);

/// Notes an identifier that CANopen gives to a service of the controller or of a node. @param file the table [bus]
void check_broadcasts_beside_nodes(const TomlTable& file, const BusDescription& bus);

}  // namespace knuckle
