// The experiments of the two papers as motions to be driven. Nothing here is optimised: that is the point of a
// baseline.
#pragma once

#include <cstdint>
#include <vector>

#include "core/joints.h"
#include "estimation/identification/excitation.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

// All stay inside the joints' ranges, clear of the soft walls, below 0.8 of the pump's flow (sum of rod speed times
// piston area), the joints' rates and the tip's speed, and start and end every move at rest.

/// K, figures 4 to 6: bucket, arm and boom, one at a time, out and back over their range at 3 cm/s of the rod.
[[nodiscard]] JointPath kim_slow_motion(const MachineDescription& machine);
/// K, figure 7 (a): bucket and arm move.
[[nodiscard]] JointPath kim_verification_1(const MachineDescription& machine);
/// K, figure 7 (b): all links move, and the boom speeds up and slows down again and again.
[[nodiscard]] JointPath kim_verification_2(const MachineDescription& machine);

/// M 3.2: 40 s of digging in the air as by hand: reach, dig, lift, dump, never twice the same.
[[nodiscard]] JointPath malaguti_dig_like_motion(const MachineDescription& machine, std::uint64_t seed);

/// M 3.1: poses over the whole range but its ends, in an order of short ways.
[[nodiscard]] std::vector<JointVector> static_poses(const MachineDescription& machine, int count, std::uint64_t seed);

}  // namespace knuckle::estimation
