// Causes between the two sides: network, programs, what the operator's side sends.
#pragma once

#include <optional>

#include "app/explain/cause.h"

namespace knuckle::explain {

/// nullopt where the stop has another reason than the link.
[[nodiscard]] std::optional<Cause> link_cause(const Stop& stop, const Window& window, const Evidence& evidence);

}  // namespace knuckle::explain
