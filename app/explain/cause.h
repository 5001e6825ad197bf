// The most likely cause of a stop, from what the wires say; the fault's code only tells where to look first.
#pragma once

#include <string>
#include <vector>

#include "app/explain/evidence.h"
#include "app/explain/window.h"
#include "machine/description.h"

namespace knuckle::explain {

struct Cause {
  std::string id;                     ///< Stable, for JSON: "node_silent".
  std::string text;                   ///< What happened, and what to check.
  std::vector<std::string> supports;  ///< What speaks for it.
  std::vector<std::string> against;   ///< What speaks against it, or looks the same and cannot be told from it.
  Time since{};                       ///< First sign of it on the wires.
};

[[nodiscard]] Cause likely_cause(const Stop& stop, const Window& window, const Evidence& evidence,
                                 const MachineDescription& machine);

}  // namespace knuckle::explain
