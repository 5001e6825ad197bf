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
  /// Tip speed in free air: the force limit divided by this. It is F / v of an impact at speed v before the valves have
  /// closed, F = v sqrt(k m) + k v T: m some 150 kg, k stiff ground in series with the oil, T = 0.12 s of filters,
  /// valve delay and spool.
  double free_Ns_per_m = 6e4;
  double lead_s = 0.15;        ///< A rising force is extrapolated by this: filters, valves and spools.
  double lead_Hz = 8;          ///< Low-pass of its rate of rise.
  double contact_share = 0.2;  ///< Of the limit: below, the force's direction is not used.
  bool slows_in_air = true;    ///< Also where nothing is touched, and where the way out is not known.
  ReasonCode reason = ReasonCode::kAssistForce;
};
inline constexpr AssistLimits kAssistLimits{};
/// For the machine file's ceiling, which is always on. It does not slow free motion, and extrapolates less: the false
/// force of a failing sensor must not hold the machine still before the sensor's fault is found.
inline constexpr AssistLimits kCeilingLimits{.lead_s = 0.1, .slows_in_air = false, .reason = ReasonCode::kForceCeiling};

struct LimitedApproach {
  JointVector rate_radps = JointVector::Zero();
  Reason limiting;  ///< AssistLimits::reason [N], or kAssistForceUnknown; kNone where nothing was changed.
};

/// Force of the world on the tip (fast channel, frame M), at any confidence: low confidence must not lift a limit. Not
/// finite where the estimate is not.
[[nodiscard]] PlanarVector raw_tip_force(const PlanarJacobian& jacobian,
                                         const estimation::ForceEstimate& force) noexcept;

/// Force of the world on the tip, frame M: now, and extrapolated while it rises (never smaller than now).
struct TipContact {
  PlanarVector now_N = PlanarVector::Zero(), ahead_N = PlanarVector::Zero();
  double direction_trust = 0;
};

/// Extrapolates a rising force by AssistLimits::lead_s. A force that is not finite is passed on and not remembered.
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

/// Where a torque is missing: rates that do not move the tip in a direction in which a force could be there unseen, its
/// 95 % interval wider than +-kUnseenForce_N. From three quarters of that on they are slowed down.
inline constexpr double kUnseenForce_N = 300;
/// @param covariance_Nm2 of the joint torques, as ForceEstimate has it. @param came_mps how the tip moved before it
/// touched: back that way, within 45 degrees, it meets nothing, and is not held. @return limiting: kForceUnknown
[[nodiscard]] LimitedApproach limit_unseen(const JointVector& rate_radps, const PlanarJacobian& jacobian,
                                           const Eigen::Matrix3d& covariance_Nm2,
                                           const PlanarVector& came_mps) noexcept;

/// Joint rates or ways that move the point of this Jacobian by no more than `most` along `into`: those that press are
/// scaled by one factor, those that lead away stay. No joint is turned round, nor grows, nor comes from nothing.
[[nodiscard]] JointVector pressing_at_most(const JointVector& joints, const PlanarJacobian& jacobian,
                                           const PlanarVector& into, double most) noexcept;

/// Slows what would press the tip harder than limit_N into what it touches. With n pointing into the contact
/// (against the force) and J the tip's Jacobian, joint i adds n' J_i rate_i to the speed into it: the joints that add
/// are scaled by one factor so that the sum stays within what the force leaves, v_free (1 - F / limit). Joints that
/// lead away keep their rate: no rate changes its sign, grows, or comes from nothing. In free air, where the direction
/// of the next contact is unknown, all joints are scaled to v_free; likewise on the way out of a contact, as far as the
/// force's direction is not trusted. A force that is not finite holds all joints still.
/// @param limit_N 0: off, nothing is changed.
[[nodiscard]] LimitedApproach limit_approach(const JointVector& rate_radps, const PlanarJacobian& jacobian,
                                             const TipContact& contact, double limit_N,
                                             const AssistLimits& limits = kAssistLimits) noexcept;

}  // namespace knuckle::slave
