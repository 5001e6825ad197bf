// --truth FILE: the simulated machine's own parameters, instead of sampling them from the seed.
#pragma once

#include <string>

#include "sim/truth.h"

namespace knuckle::session {

/// Keys that are absent stay as the machine file says. @throws InputError naming file, key, value and bound.
[[nodiscard]] sim::MachineTruth load_truth(const std::string& path, const MachineDescription& nominal);

}  // namespace knuckle::session
