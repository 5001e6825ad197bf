// The last inputs of each wire at a stop, how old they were, and which changed first.
#pragma once

#include <string>
#include <vector>

#include "app/explain/evidence.h"
#include "app/explain/window.h"

namespace knuckle::explain {

[[nodiscard]] std::vector<std::string> last_inputs(const Stop& stop, const Window& window, const Evidence& evidence);
/// Of a recording in which nothing stopped the machine: what is out of the ordinary on its bus all the same.
[[nodiscard]] std::vector<std::string> unusual(const Evidence& evidence, const Window& window);

}  // namespace knuckle::explain
