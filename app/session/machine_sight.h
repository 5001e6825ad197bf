// What a camera on a simulated machine has before it: plain data that crosses from the machine's thread to the one that
// draws.
#pragma once

#include "core/joints.h"
#include "core/time.h"
#include "sim/plant.h"
#include "sim/world.h"

namespace knuckle::session {

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
