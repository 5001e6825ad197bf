// [[bus.node]] of a machine file, or [bus.nodes] of older ones: nodes, channels and the identifiers of their frames.
#pragma once

#include <vector>

#include "machine/bus_description.h"
#include "machine/description.h"
#include "machine/toml_reader.h"

namespace knuckle {

/// Notes what is wrong with them, and with them beside the frames that the bus has already.
/// @param file [bus] @param bus its rates and frames; gets the frames of modules
[[nodiscard]] std::vector<NodeDescription> read_nodes(TomlTable& file, BusDescription& bus,
                                                      const SensorDescription& sensors);

}  // namespace knuckle
