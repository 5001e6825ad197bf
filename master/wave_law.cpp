#include "master/wave_law.h"

#include <algorithm>
#include <cmath>

namespace knuckle::master {

PlanarVector WaveLaw::step(const FeltInputs& in, double dt_s) noexcept {
  impedance_Ns_per_m_ = kHand_Ns_per_m / (in.force_scale * in.position_scale);
  if (!in.engaged || in.silence_s >= kHoldSilence_s) {
    returning_.skip();
    kept_J_ = 0;
    return PlanarVector::Zero();
  }
  returning_.take(in.returned_at, in.returned, in.now);
  const double b = impedance_Ns_per_m_, root = std::sqrt(2 * b);
  const PlanarVector returning = returning_.step(in.now, dt_s);
  const PlanarVector speed_mps = in.position_scale * in.hand_mps;
  PlanarVector against_N = b * speed_mps - root * returning;
  const double most_N = force_limit_N_ / in.force_scale, size_N = against_N.norm();
  if (size_N > most_N) against_N *= most_N / size_N;
  PlanarVector wave = (b * speed_mps + against_N) / root;
  kept_J_ = std::max(0.0, kept_J_ + dt_s * (rendered_ * against_N.dot(speed_mps) + 0.5 * returning.squaredNorm()));
  const double cost_J = 0.5 * dt_s * wave.squaredNorm();
  if (cost_J > kept_J_) wave *= std::sqrt(kept_J_ / cost_J);
  kept_J_ -= std::min(cost_J, kept_J_);
  leaving_.add(wave, dt_s);
  return -in.force_scale * against_N;
}

}  // namespace knuckle::master
