// Which parameter moves the border of the contact loop, and which way, by the linear model.
#pragma once

#include <cstdint>
#include <ostream>

#include "app/studies/contact_table.h"

namespace knuckle::studies {

/// One line: pose, wall, border Ks, then its change in percent for each change of the machine. The hold is that of the
/// simulated machine with ideal valves and a stiff law.
void print_sensitivity(const MachineDescription& machine, const ContactCell& cell, std::uint64_t seed,
                       std::ostream& out);

}  // namespace knuckle::studies
