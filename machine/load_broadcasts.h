// [[bus.broadcast]] of a machine file: frames that the machine's own controller sends; and the inputs of a module,
// which are frames, too.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "machine/bus_description.h"
#include "machine/description.h"
#include "machine/toml_reader.h"

namespace knuckle {

/// Whether the machine is led by what it has, so that it must not be older than sensors may be.
[[nodiscard]] bool leads(const BroadcastFrame& frame) noexcept;

/// Place in kSignals; nothing where this is no signal that a frame of the machine may have.
[[nodiscard]] std::optional<std::size_t> measured_signal(const std::string& name);
[[nodiscard]] std::vector<std::string> measured_signal_names();

/// Notes what is wrong with them, each by itself and beside the others; what nodes have is not looked at.
/// @param bus its rates and limits.
[[nodiscard]] std::vector<BroadcastFrame> read_broadcasts(std::vector<TomlTable> files,
                                                          std::vector<TomlTable> on_second, const BusDescription& bus,
                                                          const SensorDescription& sensors);

/// Likewise [bus.node.inputs], without identifiers. @param node its name and id
[[nodiscard]] std::vector<BroadcastFrame> read_inputs(TomlTable inputs, const NodeDescription& node,
                                                      const BusDescription& bus, const SensorDescription& sensors);

/// Notes pilot pressures that are a joint's one alone, or beside valve nodes. @param file [bus] @param bus all of it.
void check_pilots(const TomlTable& file, const BusDescription& bus);

}  // namespace knuckle
