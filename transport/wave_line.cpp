#include "transport/wave_line.h"

#include <algorithm>
#include <cmath>

namespace knuckle {
namespace {

constexpr int kClockDrift_ppm = 100;  // by which the shortest transit is let grow

}  // namespace

void WaveReceiver::take(Time sent_at, const Wave& wave, Time now) noexcept {
  received_J_ = fresh_ ? wave.energy_J : std::max(received_J_, wave.energy_J);
  if (fresh_) spent_J_ = received_J_, played_ = wave.integral;  // only what is put in from now on counts
  if (count_ > 0 && sent_at <= samples_[newest_].at) return;
  const Duration since = count_ > 0 ? sent_at - samples_[newest_].at : Duration::zero();
  transit_ =
      count_ > 0 ? std::min(transit_ + since / (1'000'000 / kClockDrift_ppm), now - sent_at) : Duration(now - sent_at);
  newest_ = (newest_ + 1) % kKept;
  samples_[newest_] = {sent_at, wave.integral};
  count_ = std::min(count_ + 1, kKept);
  fresh_ = false;
}

void WaveReceiver::skip() noexcept {
  count_ = 0;
  fresh_ = true;
}

const WaveReceiver::Sample& WaveReceiver::kept(std::size_t age) const noexcept {
  return samples_[(newest_ + kKept - age) % kKept];
}

PlanarVector WaveReceiver::integral_at(Time at) const noexcept {
  if (at >= kept(0).at) return kept(0).integral;
  for (std::size_t age = 1; age < count_; ++age) {
    const Sample &before = kept(age), &after = kept(age - 1);
    if (at < before.at) continue;
    const double share = to_seconds(at - before.at) / to_seconds(after.at - before.at);
    return before.integral + share * (after.integral - before.integral);
  }
  return kept(count_ - 1).integral;
}

PlanarVector WaveReceiver::step(Time now, double dt_s) noexcept {
  if (count_ == 0) return PlanarVector::Zero();
  PlanarVector wave = (integral_at(now - transit_ - kPlayOut) - played_) / kSmoothing_s;
  const double cost_J = 0.5 * wave.squaredNorm() * dt_s, left_J = std::max(0.0, received_J_ - spent_J_);
  if (cost_J > left_J) wave *= std::sqrt(left_J / cost_J);
  played_ += wave * dt_s;
  spent_J_ += std::min(cost_J, left_J);
  return wave;
}

bool WaveReceiver::pay(double energy_J) noexcept {
  if (energy_J > received_J_ - spent_J_) return false;
  spent_J_ += energy_J;
  return true;
}

}  // namespace knuckle
