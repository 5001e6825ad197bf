// A press on a wall that nobody tuned to: where it stands and how stiff it is, which part of the bucket meets it, pose,
// speed, force, limb.
#pragma once

#include <random>

#include "app/battery/cell.h"
#include "machine/description.h"

namespace knuckle::battery {

/// Adds scenario and columns to a cell that has its link and machine.
/// @throws InputError where the machine has no room for any such press.
void draw_press(const MachineDescription& machine, const Settings& settings, std::mt19937_64& random, Cell& cell);

}  // namespace knuckle::battery
