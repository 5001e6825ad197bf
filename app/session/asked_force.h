// What a press should load the machine with: the force that the hand asks for, and the impact of the approach.
#pragma once

#include <vector>

#include "machine/description_fwd.h"

namespace knuckle::session {

struct Scenario;

/// By phase of the plan: for a press, felt force over `force_scale` plus the impact v sqrt(k m): approach speed,
/// stiffness of what is pressed (the wall or ground that faces the press most), and the mass of a free arm at the part
/// of the bucket that is foremost, in the pose in which the press begins. 0 for all others: a press until something
/// breaks, or on a wall that is no linear spring, asks for no certain force.
[[nodiscard]] std::vector<double> asked_forces_N(const MachineDescription& machine, const Scenario& scenario,
                                                 double force_scale);

}  // namespace knuckle::session
