// What the plant's tests share: the default machine, a working pose, and driving for a while.
#pragma once

#include <cmath>

#include "machine/load.h"
#include "sim/plant.h"
#include "tests/support/places.h"
#include "tests/support/solar.h"

namespace knuckle::sim {

inline const JointVector kWorkingPose(0.3, -1.5, -1.2);

inline Plant make_plant(const WorldDescription& world = {}, const JointVector& start = kWorkingPose) {
  Plant plant(nominal_truth(test::solar()), world, start);
  plant.set_pilot(true);
  return plant;
}
inline void demand(Plant& plant, const JointVector& demands) {
  for (int i = 0; i < kJoints; ++i) plant.set_valve_demand(i, demands[i]);
}
inline void run(Plant& plant, double seconds) {
  using namespace std::chrono_literals;
  for (int i = 0; i < static_cast<int>(seconds * 1000 + 0.5); ++i) plant.step(1ms);
}
/// Of what an element of the ledger took since `start`, what is neither passed on nor lost nor stored.
inline double missing_J(const EnergyLedger::Element& now, const EnergyLedger::Element& start) {
  return std::abs((now.in - start.in) - (now.out - start.out) - (now.lost - start.lost) - (now.stored - start.stored));
}
/// What goes through the cylinders in a millisecond, either way.
inline double through_J(const PlantState& s) {
  return 1e-3 * s.cylinder_N.cwiseProduct(s.cylinder_mps).cwiseAbs().sum();
}

}  // namespace knuckle::sim
