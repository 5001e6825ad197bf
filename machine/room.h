// What a machine's joints can reach and how fast, and what the limits of its file leave of it.
#pragma once

#include <string>
#include <vector>

#include "core/joints.h"
#include "machine/bus_description.h"
#include "machine/description_fwd.h"
#include "machine/kinematics.h"

namespace knuckle {

/// The tip in frame M at 13 angles of each joint over its working range, in every combination.
[[nodiscard]] std::vector<PlanarVector> tips_over_range(const MachineDescription& machine);

/// Shortest and longest lever of the joint's cylinder over the working range.
struct LeverRange {
  double shortest_m, longest_m;
};
[[nodiscard]] LeverRange lever_range(const MachineDescription& machine, const Kinematics& kinematics, int joint);

/// Where the joint can go by its cylinder alone: beyond the working range as far as the stroke, the linkage and a lever
/// of some millimetres go.
struct JointSpan {
  double min_rad, max_rad;
};
[[nodiscard]] JointSpan cylinder_span(const MachineDescription& machine, const Kinematics& kinematics, int joint);

/// Joint rate that the whole pump flow gives everywhere in the working range: into the head side at the longest lever.
[[nodiscard]] double fastest_rate_radps(const MachineDescription& machine, const Kinematics& kinematics, int joint);

/// A virtual wall of [limits], and how far the tip could go without it.
struct WallRoom {
  const char* key;  ///< floor_m, ceiling_m or reach_m.
  double limit_m, reached_m;
  double cut_share;  ///< Of all poses, those with the tip beyond the wall.
};
[[nodiscard]] std::vector<WallRoom> wall_rooms(const MachineDescription& machine);

/// What to know before this machine moves, a line each: a wall that cuts off a hundredth of the working range or more,
/// which may be another machine's; what it costs that a cylinder has no pressure transmitters.
[[nodiscard]] std::vector<std::string> machine_notes(const MachineDescription& machine);

}  // namespace knuckle
