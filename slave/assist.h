// Force-limited approach: the machine's own ceiling on what it may press, and a lower one that the operator can switch
// on. Pure function on joint rates; it only ever makes them smaller.
#pragma once

#include "core/filters.h"
#include "core/joints.h"
#include "core/reason.h"
#include "estimation/force_estimator.h"
#include "machine/kinematics.h"

namespace knuckle::slave {

struct AssistLimits {
  /// The tip's speed in free air is the force limit over this. What a tip at speed v presses before the valves have
  /// closed, F = v sqrt(k m) + k v T, with some 150 kg, stiff ground in series with the oil, and T = 0.12 s of filters,
  /// valve delay and spool.
  double free_Ns_per_m = 6e4;
  double lead_s = 0.15;        ///< A rising force is taken as it will be when filters, valves and spools have closed.
  double lead_Hz = 8;          ///< Low-pass of its rise.
  double contact_share = 0.2;  ///< Of the limit: from here on the force has a direction.
  bool slows_in_air = true;    ///< Also where nothing is touched, and where the way out is not known.
  ReasonCode reason = ReasonCode::kAssistForce;
};
inline constexpr AssistLimits kAssistLimits{};
/// Of the machine file's ceiling, which holds whether an operator asks for help or not: free motion is free.
/// It looks less far ahead: forces that a sick sensor feigns must not hold the machine still before it is found out.
inline constexpr AssistLimits kCeilingLimits{.lead_s = 0.1, .slows_in_air = false, .reason = ReasonCode::kForceCeiling};

struct LimitedApproach {
  JointVector rate_radps = JointVector::Zero();
  Reason limiting;  ///< AssistLimits::reason [N], or kAssistForceUnknown; kNone where nothing was changed.
};

/// Tip force of the estimator's fast channel, whatever its confidence: distrust must not lift a limit. Frame M, of the
/// world on the tip; not finite where the estimate is not.
[[nodiscard]] PlanarVector raw_tip_force(const PlanarJacobian& jacobian,
                                         const estimation::ForceEstimate& force) noexcept;

/// Force of the world on the tip, frame M: as it is, and as it will be if it goes on rising (never less).
struct TipContact {
  PlanarVector now_N = PlanarVector::Zero(), ahead_N = PlanarVector::Zero();
  double direction_trust = 0;
};

/// Looks ahead as far as valves need to close. What is not finite comes out as it is and is forgotten.
class RisingForce {
 public:
  explicit RisingForce(double step_s, const AssistLimits& limits = kAssistLimits) noexcept;
  TipContact step(const PlanarVector& force_N) noexcept;
  void reset() noexcept { started_ = false; }

 private:
  double step_s_, lead_s_;
  LowPass<PlanarVector> slope_;
  PlanarVector last_N_ = PlanarVector::Zero();
  bool started_ = false;
};

/// Joint rates or ways that move the point of this Jacobian by no more than `most` along `into`: those that press are
/// scaled by one factor, those that lead away stay. No joint is turned round, nor grows, nor comes from nothing.
[[nodiscard]] JointVector pressing_at_most(const JointVector& joints, const PlanarJacobian& jacobian,
                                           const PlanarVector& into, double most) noexcept;

/// Slows what would press the tip harder than limit_N into what it touches. With n pointing into the contact
/// (against the force) and J the tip's Jacobian, joint i adds n' J_i rate_i to the speed into it: the joints that add
/// are scaled by one factor so that the sum stays within what the force leaves, v_free (1 - F / limit). Joints that
/// lead away keep their rate: no rate changes its sign, grows, or comes from nothing. In free air, where nobody knows
/// what comes next, all joints are scaled to v_free; so they are on the way out, as far as the force's direction is not
/// trusted. A force that is not finite holds all joints still.
/// @param limit_N 0: off, nothing is changed.
[[nodiscard]] LimitedApproach limit_approach(const JointVector& rate_radps, const PlanarJacobian& jacobian,
                                             const TipContact& contact, double limit_N,
                                             const AssistLimits& limits = kAssistLimits) noexcept;

}  // namespace knuckle::slave
