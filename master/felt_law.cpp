#include "master/felt_law.h"

#include <algorithm>

namespace knuckle::master {
namespace {

constexpr double kFade_s = 1;  // between law and cues: 8 N over it is 0.008 N/ms

using AnyLaw = std::variant<EchoSpring, CuesLaw, DirectLaw>;

AnyLaw make(ControlLaw law, const DeviceDescription::Feel& feel) noexcept {
  switch (law) {
    case ControlLaw::kEchoSpring:
      return EchoSpring(feel);
    case ControlLaw::kCues:
      return CuesLaw(feel);
    case ControlLaw::kDirect:
      return DirectLaw(feel.force_limit_N);
  }
  return EchoSpring(feel);
}

}  // namespace

FeltLaw::FeltLaw(ControlLaw law, const DeviceDescription::Feel& feel) noexcept : law_(make(law, feel)), cues_(feel) {}

PlanarVector FeltLaw::step(const FeltInputs& in, double dt_s) noexcept {
  const PlanarVector force_N = std::visit([&](auto& law) { return law.step(in, dt_s); }, law_);
  rendered_N_ = spring() ? spring()->contact_N() : law() == ControlLaw::kCues ? PlanarVector::Zero() : force_N;
  if (law() == ControlLaw::kDirect || law() == ControlLaw::kCues) return force_N;
  downgraded_ = downgrade_.step(in, dt_s);
  cues_share_ = std::clamp(cues_share_ + (downgraded_ ? dt_s : -dt_s) / kFade_s, 0.0, 1.0);
  const PlanarVector cue_N = cues_.step(in, dt_s);  // always: what has been touched already is no news later
  if (cues_share_ == 0) return force_N;
  rendered_N_ *= 1 - cues_share_;
  return (1 - cues_share_) * force_N + cues_share_ * cue_N;
}

void FeltLaw::set_spring(double spring_N_per_m) noexcept {
  if (auto* echo = std::get_if<EchoSpring>(&law_)) echo->set_spring(spring_N_per_m);
}

Cue FeltLaw::cue() const noexcept {
  if (const auto* cues = std::get_if<CuesLaw>(&law_)) return cues->cue();
  return cues_share_ > 0 ? cues_.cue() : Cue::kNone;
}

}  // namespace knuckle::master
