#include "master/cues_law.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace knuckle::master {
namespace {

struct Shape {
  double amplitude_N, frequency_Hz, length_s;
};
constexpr Shape kContactShape{0.6, 60, 0.08}, kOverloadShape{0.8, 40, 0.3}, kLoadShape{0.5, 20, 0.3};
constexpr double kSigmas = 4;
constexpr double kOver_s = 0.3;                          // off for so long: the next is a new event
constexpr double kOverloadOn = 0.5, kOverloadOff = 0.4;  // of the device's force limit
constexpr double kMostSilence_s = 0.1;                   // older reports begin nothing
constexpr double kLeastConfidence = 0.1;

constexpr Shape shape_of(Cue cue) noexcept {
  return cue == Cue::kOverload ? kOverloadShape : cue == Cue::kLoad ? kLoadShape : kContactShape;
}

}  // namespace

bool CuesLaw::Watch::step(double value, double above, double below, double dt_s) noexcept {
  off_s = value < below ? off_s + dt_s : 0;
  if (off_s > kOver_s) on = false;
  if (on || value <= above) return false;
  off_s = 0;
  return on = true;
}

Cue CuesLaw::next(const FeltInputs& in, double dt_s) noexcept {
  const double reflected_N = in.reflected_N.norm(), on_N = std::max(feel_.on_N, kSigmas * in.sigma_N);
  const bool touches = contact_.step(reflected_N, on_N, feel_.off_N, dt_s);
  const bool lifts = load_.step(in.load_N.norm(), feel_.on_N, feel_.off_N, dt_s);
  overload_.step(reflected_N, kOverloadOn * feel_.force_limit_N, kOverloadOff * feel_.force_limit_N, dt_s);
  return overload_.on ? Cue::kOverload : touches ? Cue::kContact : lifts ? Cue::kLoad : Cue::kNone;
}

PlanarVector CuesLaw::step(const FeltInputs& in, double dt_s) noexcept {
  const bool heard = in.engaged && in.silence_s < kMostSilence_s && in.confidence > kLeastConfidence;
  const Cue asked = heard ? next(in, dt_s) : Cue::kNone;
  if (!in.engaged) contact_ = load_ = overload_ = {};
  into_s_ += dt_s;
  if (cue_ != Cue::kNone && into_s_ >= shape_of(cue_).length_s) cue_ = Cue::kNone;
  if (cue_ == Cue::kNone && asked != Cue::kNone) {  // one at a time, each to its end: no step between them
    cue_ = asked;
    into_s_ = 0;
    const PlanarVector& along = asked == Cue::kLoad ? in.load_N : in.reflected_N;
    direction_ = along.norm() > 0 ? PlanarVector(along.normalized()) : PlanarVector::UnitY();
  }
  if (cue_ == Cue::kNone) return PlanarVector::Zero();
  const Shape shape = shape_of(cue_);
  const double swell = std::sin(std::numbers::pi * into_s_ / shape.length_s);
  return shape.amplitude_N * swell * std::sin(2 * std::numbers::pi * shape.frequency_Hz * into_s_) * direction_;
}

}  // namespace knuckle::master
