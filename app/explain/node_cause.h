// Causes at a node of the machine's bus, at its sensor or valve, or at all of them.
#pragma once

#include <optional>

#include "app/explain/cause.h"

namespace knuckle::explain {

/// nullopt where no node shows anything.
[[nodiscard]] std::optional<Cause> node_cause(const Stop& stop, const Window& window, const Evidence& evidence,
                                              const MachineDescription& machine);

/// Its sensor sends what cannot be, or what contradicts the others. nullopt where it is no sensor, or the stop has
/// another reason.
[[nodiscard]] std::optional<Cause> sensor_cause(const Stop& stop, const Window& window, const Evidence& evidence,
                                                const MachineDescription& machine);

}  // namespace knuckle::explain
