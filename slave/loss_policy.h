// What the machine does with the operator's last set-point while newer ones fail to come. Pure; ages are counted by the
// machine's own clock from the arrival of the last *newer* packet. What ends a gap does not undo it: an outage as long
// as the neutral age counts as a loss also in the step in which the next packet comes in.
#pragma once

#include <cstdint>

#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"

namespace knuckle::slave {

struct LossLimits {
  Duration extrapolate = 20ms;      ///< Up to here the hand is taken to go on as it moved.
  Duration hold = 50ms;             ///< Up to here the position reached is held.
  Duration ramp = 150ms;            ///< By here the command has faded to zero.
  Duration neutral = 200ms;         ///< From here on the link counts as lost: latched.
  Duration max_round_trip = 500ms;  ///< Beyond it the machine holds: nobody steers by pictures that old.
  double round_trip_release = 0.9;  ///< A hold for the round trip ends below this part of its limit.
};
inline constexpr LossLimits kLossLimits{};
static_assert(kLossLimits.extrapolate <= kLossLimits.hold && kLossLimits.hold < kLossLimits.ramp);

enum class LossStage : std::uint8_t { kExtrapolate, kHold, kRamp, kZero, kLost };

struct LossDecision {
  LossStage stage = LossStage::kLost;
  JointVector position_rad = JointVector::Zero();  ///< Set-point to act on.
  JointVector velocity_radps = JointVector::Zero();
  double authority = 0;  ///< [0, 1], factor on the valve commands.
  Reason link;           ///< kLinkLost from the neutral age on: of the packet, or of the gap before it.
  Reason hold;           ///< kRoundTripTooLong.
};

/// @param position_rad, velocity_radps the newest set-point, per joint.
/// @param age time since its packet came in; negative counts as lost (a stamp from the future is not to be believed).
/// @param gap age of the newest packet known before this step took any: the age itself where nothing newer came in.
/// @param round_trip as echoed in that packet; negative counts as too long.
/// @param holding the machine already holds for the round trip.
[[nodiscard]] LossDecision loss_policy(const JointVector& position_rad, const JointVector& velocity_radps, Duration age,
                                       Duration gap, Duration round_trip, bool holding,
                                       const LossLimits& limits = kLossLimits) noexcept;

}  // namespace knuckle::slave
