// What operator, sensors and estimate said in the last second before a stop, and what each limit did.
#pragma once

#include <string>
#include <vector>

#include "app/explain/window.h"
#include "machine/description.h"

namespace knuckle::explain {

[[nodiscard]] std::vector<std::string> last_second(const Stop& stop, const Window& window,
                                                   const MachineDescription& machine);

}  // namespace knuckle::explain
