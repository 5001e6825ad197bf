// Force-limited approach.
#include "slave/assist.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "estimation/tip_force.h"

namespace knuckle::slave {
namespace {

constexpr double kStanding_mps = 1e-3;  // a tip this slow goes nowhere

}  // namespace

PlanarVector raw_tip_force(const PlanarJacobian& jacobian, const estimation::ForceEstimate& force) noexcept {
  // Only which joint is surer than which may count: a doubt that all share would draw the force towards zero.
  const JointVector variance = (force.measurement_variance_Nm2 + force.bias_variance_Nm2).cwiseMax(1.0);
  const JointVector weighed = variance / variance.minCoeff();
  return estimation::solve_tip_force(jacobian, force.fast_torque_Nm, weighed.asDiagonal()).force_N;
}

RisingForce::RisingForce(double step_s, const AssistLimits& limits) noexcept
    : step_s_(step_s), lead_s_(limits.lead_s), slope_(limits.lead_Hz, step_s, PlanarVector::Zero()) {}

TipContact RisingForce::step(const PlanarVector& force_N) noexcept {
  if (!started_) slope_.reset(PlanarVector::Zero());
  if (!std::isfinite(force_N.squaredNorm())) {
    reset();
    return {force_N, force_N};
  }
  const PlanarVector slope = started_ ? slope_.step((force_N - last_N_) / step_s_) : slope_.value();
  last_N_ = force_N;
  started_ = true;
  const PlanarVector ahead_N = force_N + lead_s_ * slope;
  return {force_N, ahead_N.squaredNorm() > force_N.squaredNorm() ? ahead_N : force_N};
}

JointVector pressing_at_most(const JointVector& joints, const PlanarJacobian& jacobian, const PlanarVector& into,
                             double most) noexcept {
  const JointVector added = (into.transpose() * jacobian).transpose().cwiseProduct(joints);
  const double pressing = added.cwiseMax(0.0).sum(), leaving = -added.cwiseMin(0.0).sum();
  if (pressing - leaving <= most) return joints;
  const double factor = (most + leaving) / pressing;  // at most 1
  return (added.array() > 0).select(factor * joints, joints);
}

LimitedApproach limit_approach(const JointVector& rate_radps, const PlanarJacobian& jacobian, const TipContact& contact,
                               double limit_N, const AssistLimits& limits) noexcept {
  LimitedApproach result{rate_radps, {}};
  if (limit_N <= 0) return result;
  // Nobody knows what the tip presses: no motion is certain not to press it harder.
  if (!std::isfinite(contact.now_N.squaredNorm()) || !std::isfinite(contact.ahead_N.squaredNorm()))
    return {JointVector::Zero(), {ReasonCode::kAssistForceUnknown}};
  const Reason slowed{limits.reason, 0, contact.now_N.norm(), limit_N};
  const double free_mps = limit_N / limits.free_Ns_per_m;
  const double least_N = limits.contact_share * limit_N;
  // Only a force that is there, not one that is foreseen, says which way is away.
  const PlanarVector tip_mps = jacobian * rate_radps;
  const bool retreating = contact.now_N.norm() > least_N && tip_mps.dot(contact.now_N) > 0;
  const double bound_mps = (retreating ? 1 - contact.direction_trust : 1) * tip_mps.norm();
  if (limits.slows_in_air && bound_mps > free_mps) {
    result.rate_radps *= free_mps / bound_mps;
    result.limiting = slowed;
  }
  const double force_N = contact.ahead_N.norm();
  if (force_N <= least_N) return result;
  const PlanarVector into = -contact.ahead_N / force_N;
  const double allowed = free_mps * std::max(0.0, 1 - force_N / limit_N);
  const JointVector before = result.rate_radps;
  result.rate_radps = pressing_at_most(before, jacobian, into, allowed);
  if (result.rate_radps == before) return result;
  result.limiting = slowed;
  return result;
}

LimitedApproach limit_unseen(const JointVector& rate_radps, const PlanarJacobian& jacobian,
                             const Eigen::Matrix3d& covariance_Nm2, const PlanarVector& came_mps) noexcept {
  constexpr double kSlowedFrom = 0.75, kTwoSided95 = 1.96, kCosine45 = 0.7071;
  LimitedApproach result{rate_radps, {}};
  const PlanarVector moves_mps = jacobian * rate_radps;
  if (-moves_mps.dot(came_mps) > kCosine45 * moves_mps.norm() * came_mps.norm()) return result;
  const auto none = estimation::solve_tip_force(jacobian, JointVector::Zero(), covariance_Nm2);
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> spread;
  spread.computeDirect(none.covariance_N2);
  // Where neither is seen, stopping one joint for the one axis could let another go along the other.
  const double surest_N = kTwoSided95 * std::sqrt(std::max(0.0, spread.eigenvalues()[0]));
  if (surest_N > kSlowedFrom * kUnseenForce_N) {
    result.rate_radps *= std::clamp((1 - surest_N / kUnseenForce_N) / (1 - kSlowedFrom), 0.0, 1.0);
    result.limiting = {ReasonCode::kForceUnknown, 0, surest_N, kUnseenForce_N};
  }
  for (int axis = 0; axis < 2; ++axis) {
    const double interval_N = kTwoSided95 * std::sqrt(std::max(0.0, spread.eigenvalues()[axis]));
    const double share = std::clamp((1 - interval_N / kUnseenForce_N) / (1 - kSlowedFrom), 0.0, 1.0);
    if (share == 1) continue;
    for (const double side : {1.0, -1.0}) {
      const PlanarVector way = side * spread.eigenvectors().col(axis);
      const double speed_mps = way.dot(jacobian * result.rate_radps);
      if (speed_mps <= kStanding_mps) continue;
      result.rate_radps = pressing_at_most(result.rate_radps, jacobian, way, share * speed_mps);
      result.limiting = {ReasonCode::kForceUnknown, 0, interval_N, kUnseenForce_N};
    }
  }
  return result;
}

}  // namespace knuckle::slave
