#include "master/tdpa_law.h"

#include <algorithm>
#include <cmath>

#include "core/trust.h"

namespace knuckle::master {
namespace {

constexpr double kMostDamping_Ns_per_m = 100;  // what a hand of 0.1 kg and a 1 ms loop with its delays stay stable with
constexpr double kLeastSpeed_mps = 1e-4;       // below it no damping moves energy
constexpr double kFade_s = 0.06;
constexpr double kLeastRendered = 1e-3;

}  // namespace

PlanarVector TdpaLaw::spring_force(const FeltInputs& in, double dt_s) noexcept {
  const double reflected_N = in.reflected_N.norm();
  contact_ = in.engaged && reflected_N > (contact_ ? feel_.off_N : std::max(feel_.on_N, 4 * in.sigma_N));
  if (contact_) normal_ = in.reflected_N / reflected_N;
  const double trusted = trust(in.confidence);
  const double wanted = contact_ && in.silence_s < kHoldSilence_s ? trusted : 0;
  share_ += std::clamp(wanted - share_, -dt_s / kFade_s, dt_s / kFade_s);
  const double stretched_m = std::max(0.0, normal_.dot(in.machine_m - in.hand_m));
  return share_ * std::min(spring_N_per_m_ * stretched_m, feel_.force_limit_N) * normal_;
}

PlanarVector TdpaLaw::step(const FeltInputs& in, double dt_s) noexcept {
  PlanarVector force_N = spring_force(in, dt_s);
  const double world_J = std::max(world_J_, in.world_energy_J);
  if (in.engaged) observed_J_ += world_J - world_J_;
  world_J_ = in.engaged ? world_J : in.world_energy_J;  // a machine's side that starts anew counts from zero
  damping_Ns_per_m_ = 0;
  const double speed2 = in.hand_mps.squaredNorm();
  const double ahead_J = observed_J_ - rendered_ * force_N.dot(in.hand_mps) * dt_s;  // without the controller
  if (ahead_J < 0 && speed2 > kLeastSpeed_mps * kLeastSpeed_mps && in.engaged) {
    const double per_damping_J = std::max(rendered_, kLeastRendered) * speed2 * dt_s;
    damping_Ns_per_m_ = std::min(kMostDamping_Ns_per_m, -ahead_J / per_damping_J);
    force_N -= damping_Ns_per_m_ * in.hand_mps;
    const double size_N = force_N.norm();
    if (size_N > feel_.force_limit_N) force_N *= feel_.force_limit_N / size_N;
  }
  observed_J_ -= rendered_ * force_N.dot(in.hand_mps) * dt_s;
  if (!in.engaged) observed_J_ = 0;
  return force_N;
}

}  // namespace knuckle::master
