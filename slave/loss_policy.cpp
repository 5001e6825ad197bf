#include "slave/loss_policy.h"

#include <algorithm>

namespace knuckle::slave {
namespace {

LossStage stage_at(Duration age, const LossLimits& limits) noexcept {
  if (age < Duration::zero() || age >= limits.neutral) return LossStage::kLost;
  if (age <= limits.extrapolate) return LossStage::kExtrapolate;
  if (age <= limits.hold) return LossStage::kHold;
  if (age < limits.ramp) return LossStage::kRamp;
  return LossStage::kZero;
}

/// Of a link that is not lost.
double authority_at(Duration age, const LossLimits& limits) noexcept {
  return std::clamp(to_seconds(limits.ramp - age) / to_seconds(limits.ramp - limits.hold), 0.0, 1.0);
}

}  // namespace

LossDecision loss_policy(const JointVector& position_rad, const JointVector& velocity_radps, Duration age, Duration gap,
                         Duration round_trip, bool holding, const LossLimits& limits) noexcept {
  LossDecision decision;
  decision.stage = gap >= limits.neutral ? LossStage::kLost : stage_at(age, limits);
  if (decision.stage != LossStage::kLost) decision.authority = authority_at(age, limits);
  const Duration ahead = std::clamp(age, Duration::zero(), limits.extrapolate);
  decision.position_rad = position_rad + velocity_radps * to_seconds(ahead);
  if (decision.stage == LossStage::kExtrapolate) decision.velocity_radps = velocity_radps;
  if (decision.stage == LossStage::kLost)
    decision.link = {ReasonCode::kLinkLost, 0, to_ms(std::max(age, gap)), to_ms(limits.neutral)};
  const double release = holding ? limits.round_trip_release : 1.0;
  if (round_trip < Duration::zero() || to_seconds(round_trip) > release * to_seconds(limits.max_round_trip))
    decision.hold = {ReasonCode::kRoundTripTooLong, 0, to_ms(round_trip), to_ms(limits.max_round_trip)};
  return decision;
}

}  // namespace knuckle::slave
