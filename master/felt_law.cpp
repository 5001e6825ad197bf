#include "master/felt_law.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/trust.h"

namespace knuckle::master {
namespace {

constexpr double kNormalCutoff_Hz = 0.3;  // friction turns R by 20 degrees; faster makes a limit cycle
constexpr double kTangentialShare = 0.3;  // of the normal force
constexpr double kSigmas = 4;             // a contact begins so far above the estimate's own noise
constexpr double kDwell_s = 1.0;
constexpr double kFadeOut_s = 0.4, kQuickFadeOut_s = 0.06;
constexpr double kBiasLeak_s = 0.2;
constexpr double kReleaseForce_N = 0.3;  // below it leaving and a broken wall close at once
constexpr double kLeavingSpeed_mps = 5e-3;
constexpr double kLeavingTime_s = 0.05;
constexpr double kGaveWay_m = 0.3e-3;
constexpr double kCautionTime_s = 1.0;
constexpr double kThresholdSpeed_mps = 0.025;  // R_on doubles at this speed (0.25 m/s of the machine at 10:1)
constexpr double kSpeedMemory_s = 0.3;         // braking errs in force when speed is gone already
constexpr double kDampingFadeIn_s = 0.1;
constexpr double kFrozenAfter_s = 0.03;  // silence: the anchor stays where it is
constexpr double kSilenceFade_s = 0.2;
constexpr double kTrustTime_s = 0.2;
constexpr double kLoadTime_s = 0.1;
// What the correction learns at once at most. A machine that lags at the touch makes the pair differ by 10 N and more,
// which is no mismatch of springs and is gone when it stands.
constexpr double kMismatch_N = 1;
// Where the touched thing moves along with the machine (soil, a load), the lead changes with every change of speed, and
// the force is no spring's: the correction follows both at once. Not at the touch: there every wall seems to give way.
constexpr double kCarriedBias_s = 0.1, kCarriedMismatch_N = 10, kCarried_mps = 5e-3, kTouch_s = 0.2;
// What lies across the normal within the cone of usual friction (tan 14 degrees) does not turn it: the wall has not
// turned. Otherwise hand and machine chase each other across the contact, R being late.
constexpr double kFrictionCone_rad = 0.25;
// Friction is felt at once, and remembered while it turns round: R across passes through zero, late, just when the
// hand is to be held.
constexpr double kShearTime_s = 0.1, kShearMemory_s = 1.5;
constexpr double kCatch_s = 1.0;
constexpr double kCatchDamping_Ns_per_m = 100;
constexpr double kCarriedTime_s = 0.1;  // of the speed at which the anchor is carried

/// Of the direction (of unit length), what points outside the cone around the normal; inside, the normal.
PlanarVector turned_beyond(double cone_rad, const PlanarVector& normal, const PlanarVector& direction) noexcept {
  const PlanarVector across(-normal.y(), normal.x());
  const double angle_rad = std::atan2(across.dot(direction), normal.dot(direction));
  const double beyond_rad = angle_rad - std::clamp(angle_rad, -cone_rad, cone_rad);
  return std::cos(beyond_rad) * normal + std::sin(beyond_rad) * across;
}

PlanarVector within(double most, const PlanarVector& vector) noexcept {
  const double size = vector.norm();
  return size > most ? PlanarVector(vector * (most / size)) : vector;
}

double blend(double dt_s, double time_s) noexcept {
  return -std::expm1(-dt_s / time_s);
}

}  // namespace

PlanarVector EchoSpring::step(const FeltInputs& in, double dt_s) noexcept {
  update_gate(in, dt_s);
  const bool silent = in.silence_s > kFrozenAfter_s;
  const PlanarVector along_mps = silent ? PlanarVector::Zero() : PlanarVector(in.contact_compliance * in.machine_mps);
  carried_mps_ += (along_mps - carried_mps_) * blend(dt_s, kCarriedTime_s);
  if (!silent) update_anchor(in, dt_s);
  update_fades(in, dt_s);
  contact_N_ = gate_ > 0 ? raw_force(in) : PlanarVector::Zero();
  catching_s_ = contact_ || !in.engaged ? 0 : std::max(0.0, catching_s_ - dt_s);
  contact_N_ += catching(in, contact_N_.dot(normal_));
  load_N_ += (in.load_N - load_N_) * blend(dt_s, kLoadTime_s);
  const PlanarVector all_N = contact_N_ + engagement_ * freshness_ * trust_ * load_N_;
  const PlanarVector force_N = within(feel_.force_limit_N, all_N);
  rendered_N_ = force_N - all_N + contact_N_;
  return force_N;
}

void EchoSpring::update_gate(const FeltInputs& in, double dt_s) noexcept {
  recent_speed_mps_ = std::max(in.machine_mps.norm(), recent_speed_mps_ * (1 - blend(dt_s, kSpeedMemory_s)));
  cautious_s_ = std::max(0.0, cautious_s_ - dt_s);
  threshold_N_ = std::max(feel_.on_N, kSigmas * in.sigma_N) * (1 + recent_speed_mps_ / kThresholdSpeed_mps) *
                 (cautious_s_ > 0 ? 2 : 1);
  if (!in.engaged || in.silence_s >= kHoldSilence_s + kSilenceFade_s) return close(kQuickFadeOut_s);
  if (!contact_) {
    if (in.silence_s <= kFrozenAfter_s && in.reflected_N.norm() > threshold_N_) open(in);
    return;
  }
  if (in.silence_s > kFrozenAfter_s) return;
  const double reflected_N = normal_.dot(in.reflected_N);
  quiet_s_ = reflected_N > feel_.off_N ? 0 : quiet_s_ + dt_s;
  if (hand_leaves(in, dt_s)) {
    cautious_s_ = kCautionTime_s;
    close(kQuickFadeOut_s);
  } else if (wall_gave_way(in, reflected_N) ||
             -reflected_N > threshold_N_) {  // or the contact is on the other side now
    close(kQuickFadeOut_s);
  } else if (quiet_s_ > kDwell_s) {
    close(kFadeOut_s);
  }
}

void EchoSpring::open(const FeltInputs& in) noexcept {
  contact_ = true;
  direction_ = normal_ = in.reflected_N.normalized();
  // No step in force: what is still felt of a contact that fades is carried over.
  anchor_m_ = in.hand_m + normal_ * std::max(0.0, contact_N_.dot(normal_)) / spring_N_per_m_;
  bias_N_.setZero();
  shear_N_ = 0;
  quiet_s_ = leaving_s_ = touched_s_ = damping_share_ = 0;
  pressed_at_m_ = in.machine_m;
  gate_ = 1;
}

void EchoSpring::close(double fade_time_s) noexcept {
  if (contact_ || fade_time_s < gate_fade_s_) gate_fade_s_ = fade_time_s;
  if (contact_) {
    caught_N_ = std::max(0.0, contact_N_.dot(normal_));
    catching_s_ = kCatch_s;
  }
  contact_ = false;
}

bool EchoSpring::hand_leaves(const FeltInputs& in, double dt_s) noexcept {
  const bool leaving = normal_.dot(in.hand_mps) > kLeavingSpeed_mps;
  leaving_s_ = leaving ? leaving_s_ + dt_s : 0;
  return leaving_s_ >= kLeavingTime_s && in.reflected_N.norm() < kReleaseForce_N;
}

bool EchoSpring::wall_gave_way(const FeltInputs& in, double reflected_N) noexcept {
  if (reflected_N >= kReleaseForce_N) pressed_at_m_ = in.machine_m;
  return in.reflected_N.norm() < kReleaseForce_N && -normal_.dot(in.machine_m - pressed_at_m_) > kGaveWay_m;
}

void EchoSpring::update_anchor(const FeltInputs& in, double dt_s) noexcept {
  const double reflected_size_N = in.reflected_N.norm();
  if (contact_ && reflected_size_N > feel_.off_N) {
    const PlanarVector turned = turned_beyond(kFrictionCone_rad, normal_, in.reflected_N / reflected_size_N);
    direction_ += (turned - direction_) * blend(dt_s, 1 / (2 * std::numbers::pi * kNormalCutoff_Hz));
    if (direction_.squaredNorm() > 1e-6) normal_ = direction_.normalized();
  }
  const double reflected_N = normal_.dot(in.reflected_N);
  const double across_N = (in.reflected_N - normal_ * reflected_N).norm();
  shear_N_ += (across_N - shear_N_) * blend(dt_s, across_N > shear_N_ ? kShearTime_s : kShearMemory_s);
  if (contact_ && reflected_N >= feel_.off_N) {
    const PlanarVector wanted_N = in.reflected_N + spring_N_per_m_ * in.ahead_m;
    touched_s_ += dt_s;
    const double speed2 = in.machine_mps.squaredNorm();
    const double moves_along = touched_s_ < kTouch_s + in.round_trip_s
                                   ? 0
                                   : in.contact_compliance * speed2 / (speed2 + kCarried_mps * kCarried_mps);
    const double time_s = std::lerp(feel_.bias_time_s, kCarriedBias_s, moves_along);
    const double at_once_N = std::lerp(kMismatch_N, kCarriedMismatch_N, moves_along);
    bias_N_ += within(at_once_N, wanted_N - bias_N_) * blend(dt_s, time_s + feel_.bias_time_per_rtt * in.round_trip_s);
    const double limit_N =
        feel_.bias_limit_N + in.contact_compliance * std::max(0.0, feel_.force_limit_N - feel_.bias_limit_N);
    bias_N_ = within(limit_N, bias_N_);
  } else {
    bias_N_ -= bias_N_ * blend(dt_s, kBiasLeak_s);
  }
  anchor_m_ += carried_mps_ * dt_s;  // what moves along does not stretch the spring
  anchor_m_ += (in.machine_m + bias_N_ / spring_N_per_m_ - anchor_m_) * blend(dt_s, feel_.anchor_time_s);
}

void EchoSpring::update_fades(const FeltInputs& in, double dt_s) noexcept {
  if (!contact_) gate_ = std::max(0.0, gate_ - dt_s / gate_fade_s_);
  if (gate_ == 0) gate_fade_s_ = kFadeOut_s;
  damping_share_ = contact_ ? std::min(1.0, damping_share_ + dt_s / kDampingFadeIn_s) : damping_share_;
  const double trusted = trust(in.confidence);
  trust_ += (trusted - trust_) * blend(dt_s, kTrustTime_s);
  engagement_ += ((in.engaged ? 1 : 0) - engagement_) * blend(dt_s, kLoadTime_s);
  const double fresh = std::clamp(1 - (in.silence_s - kHoldSilence_s) / kSilenceFade_s, 0.0, 1.0);
  freshness_ = std::min(fresh, freshness_ + dt_s / kSilenceFade_s);
}

/// A hand that pressed against what is gone would run on: it is slowed, never harder than it pressed.
PlanarVector EchoSpring::catching(const FeltInputs& in, double felt_N) const noexcept {
  const double most_N = caught_N_ * catching_s_ / kCatch_s - felt_N;
  const double wanted_N = kCatchDamping_Ns_per_m * -normal_.dot(in.hand_mps);
  return freshness_ * std::clamp(wanted_N, 0.0, std::max(0.0, most_N)) * normal_;
}

PlanarVector EchoSpring::raw_force(const FeltInputs& in) const noexcept {
  const PlanarVector stretched_N = spring_N_per_m_ * (anchor_m_ - in.hand_m);
  const double spring_N = normal_.dot(stretched_N);
  if (spring_N <= 0) return PlanarVector::Zero();  // never pulls into contact
  const double damping_Ns_per_m = damping_share_ * feel_.damping_Ns_per_m;
  const PlanarVector relative_mps = in.hand_mps - carried_mps_;
  const double speed_mps = normal_.dot(relative_mps);
  const double normal_N = std::max(0.0, spring_N - damping_Ns_per_m * speed_mps);
  const PlanarVector sideways_N =
      within(kTangentialShare * normal_N, -damping_Ns_per_m * (relative_mps - normal_ * speed_mps)) +
      within(shear_N_, stretched_N - normal_ * spring_N);
  return gate_ * trust_ * freshness_ * (normal_ * normal_N + sideways_N);
}

namespace {

struct Shape {
  double amplitude_N, frequency_Hz, length_s;
};
constexpr Shape kContactShape{0.6, 60, 0.08}, kOverloadShape{0.8, 40, 0.3}, kLoadShape{0.5, 20, 0.3};
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

namespace {

Reason reason(ReasonCode code, double value, double limit, double unit) noexcept {
  return {code, 0, static_cast<float>(unit * value), static_cast<float>(unit * limit)};
}

}  // namespace

void Downgrade::Cause::step(double value, const Bounds& bounds, double dt_s) noexcept {
  const bool turning = on ? value < bounds.off : value > bounds.on;
  for_s = turning ? for_s + dt_s : 0;
  if (for_s <= (on ? bounds.off_s : bounds.on_s)) return;
  on = !on;
  for_s = 0;
}

Reason Downgrade::step(const FeltInputs& in, double dt_s) noexcept {
  if (!in.engaged) {
    round_trip_ = silence_ = lost_ = doubt_ = {};
    return {};
  }
  round_trip_.step(in.round_trip_s, kRoundTrip_s, dt_s);
  silence_.step(in.silence_s, kSilence_s, dt_s);
  lost_.step(in.lost_share, kLost, dt_s);
  doubt_.step(1 - in.confidence, kDoubt, dt_s);
  constexpr double kMs = 1e3, kPercent = 100;
  if (silence_.on) return reason(ReasonCode::kCuesSilence, in.silence_s, kSilence_s.on, kMs);
  if (round_trip_.on) return reason(ReasonCode::kCuesDelay, in.round_trip_s, kRoundTrip_s.on, kMs);
  if (lost_.on) return reason(ReasonCode::kCuesLoss, in.lost_share, kLost.on, kPercent);
  if (doubt_.on) return reason(ReasonCode::kCuesEstimate, in.confidence, 1 - kDoubt.on, kPercent);
  return {};
}

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
  if (auto* direct = std::get_if<DirectLaw>(&law_)) return rendered_N_ = direct->step(in, dt_s);
  if (auto* cues = std::get_if<CuesLaw>(&law_)) return cues->step(in, dt_s);
  auto& echo = *std::get_if<EchoSpring>(&law_);
  const PlanarVector force_N = echo.step(in, dt_s);
  rendered_N_ = echo.contact_N();
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
