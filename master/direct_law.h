// Raw force reflection, F = R: the cautionary baseline. The loop hand -> machine -> force -> hand has the gain
// K_l / K_hand at rest (K_l = lambda mu Ks in series with lambda mu K_wall) and the delay of round trip, valve and
// observer. By the small-gain theorem it is stable for any delay where that gain is below 1 at all frequencies; where
// the hand is softer than that and its phase turns half a turn before the gain has fallen below 1, it is not.
#pragma once

#include "master/felt_inputs.h"

namespace knuckle::master {

class DirectLaw {
 public:
  explicit DirectLaw(double force_limit_N) noexcept : force_limit_N_(force_limit_N) {}
  [[nodiscard]] PlanarVector step(const FeltInputs& in, double /*dt_s*/) noexcept {
    constexpr double kSilence_s = 0.5;
    if (!in.engaged || in.silence_s > kSilence_s) return PlanarVector::Zero();
    const double size_N = in.reflected_N.norm();
    return size_N > force_limit_N_ ? PlanarVector(in.reflected_N * (force_limit_N_ / size_N)) : in.reflected_N;
  }

 private:
  double force_limit_N_;
};

}  // namespace knuckle::master
