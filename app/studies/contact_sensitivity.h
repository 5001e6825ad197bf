// Which parameter brings the contact loop closer to swinging, and which keeps it away, by the linear model.
#pragma once

#include <cstdint>
#include <ostream>

#include "app/studies/contact_table.h"

namespace knuckle::studies {

/// One line: pose, wall, the loop's gain where it would swing (1 swings), then its change in percent for each change of
/// the machine. The hold is that of the simulated machine with ideal valves, law as on file.
void print_sensitivity(const MachineDescription& machine, const ContactCell& cell, std::uint64_t seed,
                       std::ostream& out);

}  // namespace knuckle::studies
