#include "estimation/identification/path_room.h"

#include <algorithm>
#include <array>

#include "core/error.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::estimation {
namespace {

constexpr double kMargin_rad = 0.03;   ///< Beyond the soft margin: what following overshoots.
constexpr double kWallMargin_m = 0.1;  ///< Likewise; near a wall the gate slows down.
constexpr double kShare = 0.95;        ///< Of every limit of speed.
constexpr double kGentle_mps2 = 3;     ///< Tip acceleration: tracks stay on the ground, modes stay quiet.

constexpr int kGrid = 8;
/// Where a smaller window lies in the range: 0 at its lower end, 1 at its upper one.
const std::array<JointVector, 6> kPlaces{
    {{0.5, 0.5, 0.5}, {1, 0.5, 0.5}, {0.5, 0, 0.5}, {1, 0, 0.5}, {0, 0.5, 0.5}, {0, 0, 0.5}}};

bool clear_of_walls(const LimitsDescription& limits, const Kinematics& kinematics, const PathRoom& room) {
  for (int i = 0; i < kGrid * kGrid * kGrid; ++i) {
    const int arm = i / kGrid, bucket = arm / kGrid;
    const JointVector share = JointVector(i % kGrid, arm % kGrid, bucket) / (kGrid - 1.0);
    const PlanarVector tip = kinematics.tip(room.low_rad + share.cwiseProduct(room.high_rad - room.low_rad));
    if (tip.y() < limits.floor_m + kWallMargin_m || tip.y() > limits.ceiling_m - kWallMargin_m ||
        tip.x() > limits.reach_m - kWallMargin_m) {
      return false;
    }
  }
  return true;
}

}  // namespace

PathRoom::PathRoom(const MachineDescription& machine)
    : flow_m3ps(kShare * kPathPumpShare * machine.hydraulics.pump_flow_m3ps),
      tip_speed_mps(kShare * machine.limits.tip_speed_mps),
      tip_mps2(kGentle_mps2) {
  const Kinematics kinematics(machine);
  const double margin = machine.limits.joint_soft_margin_rad + kMargin_rad;
  for (int joint = 0; joint < kJoints; ++joint) {
    rate_radps[joint] = kShare * machine.links[static_cast<std::size_t>(joint)].max_rate_radps;
  }
  for (int twentieths = 20; twentieths >= 7; --twentieths) {
    for (const JointVector& place : kPlaces) {
      for (int joint = 0; joint < kJoints; ++joint) {
        const LinkDescription& link = machine.links[static_cast<std::size_t>(joint)];
        const double whole = std::max(0.0, link.max_rad - link.min_rad - 2 * margin);
        low_rad[joint] = link.min_rad + margin + place[joint] * (1 - twentieths / 20.0) * whole;
        high_rad[joint] = low_rad[joint] + twentieths / 20.0 * whole;
      }
      if (clear_of_walls(machine.limits, kinematics, *this)) return;
    }
  }
  throw InputError(machine.source + ": no room to move in between the virtual walls of [limits]");
}

double PathRoom::speed_use(const PathExtremes& extremes, double fastest_mps) const {
  return std::max({extremes.fastest_radps.cwiseQuotient(rate_radps).maxCoeff(), extremes.flow_m3ps / flow_m3ps,
                   extremes.tip_speed_mps / tip_speed_mps, extremes.fastest_cylinder_mps.maxCoeff() / fastest_mps});
}

}  // namespace knuckle::estimation
