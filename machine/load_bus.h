// The bus of a machine file, as strict as the rest of it.
#pragma once

#include <vector>

#include "machine/bus_description.h"
#include "machine/description.h"
#include "machine/toml_reader.h"

namespace knuckle {

/// The table [bus]: frames that the machine sends by itself, and the nodes in the words of today or in older ones.
/// Notes what is wrong with it; also a bus that is too full.
/// @param files as bus_tables() gives them
[[nodiscard]] BusDescription read_bus(std::vector<TomlTable> files, const SensorDescription& sensors);

/// What `knuckle commission` has found of guards, from the table [commissioning]: the rest of that is for people and
/// tools. What it says of a node that is no longer there is nothing.
void read_guard_proofs(TomlTable record, BusDescription& bus);

}  // namespace knuckle
