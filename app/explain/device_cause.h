// Causes at the haptic device.
#pragma once

#include <optional>

#include "app/explain/cause.h"

namespace knuckle::explain {

/// nullopt where the stop has another reason than the device.
[[nodiscard]] std::optional<Cause> device_cause(const Stop& stop, const Window& window, const Evidence& evidence);

}  // namespace knuckle::explain
