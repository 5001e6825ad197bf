// What one millisecond of a bilateral law sees at the operator's side.
#pragma once

#include "core/joints.h"

namespace knuckle::master {

/// A machine that is silent for longer is felt no more, or less and less.
inline constexpr double kHoldSilence_s = 0.3;

/// Positions, speeds and forces at hand scale, frame D.
struct FeltInputs {
  PlanarVector hand_m = PlanarVector::Zero();     ///< x_m: tip of the set-point the hand asks for
  PlanarVector hand_mps = PlanarVector::Zero();   ///< v_m
  PlanarVector machine_m = PlanarVector::Zero();  ///< x_s: newest measured machine tip
  PlanarVector machine_mps = PlanarVector::Zero();
  PlanarVector ahead_m = PlanarVector::Zero();      ///< x_a: how far the set-point was ahead of it behind reflected_N
  PlanarVector reflected_N = PlanarVector::Zero();  ///< R = lambda * estimated force of the world on the tip
  PlanarVector load_N = PlanarVector::Zero();       ///< lambda * what the load adds to it
  double sigma_N = 0;                               ///< lambda * standard deviation of R
  double contact_compliance = 0;                    ///< y [0, 1]: what is pressed moves along with the tip
  double confidence = 0;                            ///< [0, 1]
  double round_trip_s = 0;
  double silence_s = 0;   ///< Since the last newer message from the machine.
  double lost_share = 0;  ///< [0, 1] of its messages, of late: lost or overtaken.
  bool engaged = false;   ///< The hand leads the machine: only then there is a force.
};

}  // namespace knuckle::master
