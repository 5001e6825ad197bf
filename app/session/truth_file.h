// The simulated machine's own parameters: sampled from a family by the seed, or read from --truth FILE.
#pragma once

#include <cstdint>
#include <string>

#include "sim/truth.h"

namespace knuckle::session {

/// Keys that are absent stay as the machine file says. @throws InputError naming file, key, value and bound.
[[nodiscard]] sim::MachineTruth load_truth(const std::string& path, const MachineDescription& nominal);

/// As --family takes it; empty: smooth. @throws InputError
[[nodiscard]] sim::Family family_named(const std::string& name);
/// From the file where there is one, else a machine of the family. @throws InputError also where both are given.
[[nodiscard]] sim::MachineTruth truth_for(const MachineDescription& nominal, const std::string& file,
                                          const std::string& family, std::uint64_t seed);

}  // namespace knuckle::session
