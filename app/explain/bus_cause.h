// Causes on the bus itself: who else speaks there.
#pragma once

#include <optional>

#include "app/explain/cause.h"

namespace knuckle::explain {

/// nullopt where the stop has another reason than somebody else on the bus.
[[nodiscard]] std::optional<Cause> bus_cause(const Stop& stop, const Window& window, const MachineDescription& machine);

}  // namespace knuckle::explain
