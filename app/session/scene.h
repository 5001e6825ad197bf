// What stands around the machine: as lines for drawings, and as a camera on a simulated machine has it before it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/session/session_record.h"
#include "core/joints.h"
#include "core/time.h"
#include "sim/plant.h"
#include "sim/world.h"

namespace knuckle::session {

/// A line of the world for drawings, frame M. It may exist for a part of the session only (a wall before it broke).
struct SceneLine {
  enum class Kind : std::uint8_t { kGround, kWall, kPiece, kSoil, kVirtualWall };
  std::string name;
  Kind kind = Kind::kGround;
  std::vector<PlanarVector> points_m;
  bool closed = false;  ///< An area; otherwise an open line with material below it (ground, soil).
  double from_s = 0, until_s = 1e18;
  bool breaks = false;  ///< A wall that force can break.
};
using Scene = std::vector<SceneLine>;

/// Ground, walls (until they broke), loose pieces (where and while they lie), soil and pipes of a world, frame M for a
/// level hull. What has no end is drawn as far as matters for a machine of this reach.
[[nodiscard]] Scene scene_of(const sim::WorldDescription& world, const SessionRecord& record, double reach_m);

/// Plain data that crosses from the machine's thread to the one that draws.
struct MachineSight {
  Time at{};                                    ///< When it was so, by the clock of pictures (video::now()).
  double session_s = 0;                         ///< The same by the session's clock, which the events have.
  JointVector joint_rad = JointVector::Zero();  ///< The true ones.
  sim::WorldEventRing events;
};

[[nodiscard]] inline MachineSight sight_of(const sim::PlantState& plant, Time at) noexcept {
  return {at, plant.t_s, plant.joint_rad, plant.events};
}

}  // namespace knuckle::session
