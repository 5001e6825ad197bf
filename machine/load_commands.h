// [[bus.command]] of a machine file: frames that tell the machine's own controller what to do.
#pragma once

#include <vector>

#include "machine/bus_description.h"
#include "machine/toml_reader.h"

namespace knuckle {

/// Sets BusDescription::commands and command_kind. Notes what is wrong with the frames, each by itself and beside the
/// others: a field without a neutral, a value that its bits cannot say, a joint that nothing moves, or two things do.
/// @param files in [bus] @param on_second in the second [[bus]] @param bus its rates, limits and broadcasts
void read_commands(const TomlTable& file, std::vector<TomlTable> files, std::vector<TomlTable> on_second,
                   BusDescription& bus);

}  // namespace knuckle
