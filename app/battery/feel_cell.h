// A press on a wall that nobody tuned to: where it stands and how stiff it is, which part of the bucket meets it, pose,
// speed, force, limb.
#pragma once

#include <random>

#include "app/battery/cell.h"
#include "machine/description.h"
#include "sim/truth.h"

namespace knuckle::battery {

/// Adds scenario and columns to a cell that has its link and machine. No press is asked for that would tip the machine.
/// @param force_scale hand newtons per machine newton.
/// @throws InputError where the machine has no room for any such press.
void draw_press(const MachineDescription& machine, const sim::HullTruth& hull, double force_scale,
                const Settings& settings, std::mt19937_64& random, Cell& cell);

}  // namespace knuckle::battery
