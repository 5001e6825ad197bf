// [[bus.command]] of a machine file: frames that tell the machine's own controller what to do; and the outputs of a
// module, which are frames, too.
#pragma once

#include <vector>

#include "machine/bus_description.h"
#include "machine/toml_reader.h"

namespace knuckle {

/// Sets BusDescription::commands and command_kind. Notes what is wrong with the frames, each by itself and beside the
/// others: a field without a neutral, a value that its bits cannot say, a joint that two things move.
/// @param files in [bus] @param on_second in the second [[bus]] @param bus its rates, limits and broadcasts
void read_commands(const TomlTable& file, std::vector<TomlTable> files, std::vector<TomlTable> on_second,
                   BusDescription& bus);

/// Likewise [bus.node.outputs]. Sets NodeDescription::outputs; the new frames have no identifiers yet.
/// @param file [bus] @param node its name and id
void read_outputs(const TomlTable& file, TomlTable outputs, NodeDescription& node, BusDescription& bus);

/// Once all are read: notes a joint that nothing moves.
/// @param file [bus]
void check_commands(const TomlTable& file, BusDescription& bus);

}  // namespace knuckle
