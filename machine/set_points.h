// What frames on the machine's bus tell the joints to do, whoever sends them: for those who read the wire.
#pragma once

#include <optional>

#include "machine/bus_description.h"
#include "transport/signal_codec.h"

namespace knuckle {

/// The command that this frame has for a joint: [-1, 1], positive extends, 0 where its valve is told to stay closed.
/// nullopt: it has none for it.
[[nodiscard]] std::optional<double> set_point_in(const CanFrame& frame, int joint, const BusDescription& bus) noexcept;

}  // namespace knuckle
