// What a machine file says of each of its buses: name, bit rate, what others send; and whether its frames fit.
#pragma once

#include <vector>

#include "machine/bus_description.h"
#include "machine/description.h"
#include "machine/toml_reader.h"

namespace knuckle {

/// [bus], or [[bus]] once or twice. At least one. @param machine the whole file
[[nodiscard]] std::vector<TomlTable> bus_tables(TomlTable& machine);

/// What each has of its own. The second of two has frames alone. @param files as bus_tables() gives them
void read_bus_lines(std::vector<TomlTable>& files, BusDescription& bus);

/// Notes where the frames load the bus above kFullestBus. @param bus what is on this one alone
void check_bus_load(const TomlTable& file, const BusDescription& bus, const SensorDescription& sensors);

}  // namespace knuckle
