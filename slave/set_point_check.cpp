#include "slave/set_point_check.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace knuckle::slave {
namespace {

constexpr double kFilter_s = 1 / (2 * std::numbers::pi * kSetPointRateCutoff_Hz);
constexpr double kDeg = 180 / std::numbers::pi;
constexpr double kAtEnd_rad = 1e-3;

/// What one message says by itself.
Reason check_alone(const MasterMessage& message, const SetPointLimits& limits,
                   const JointVector& machine_rad) noexcept {
  const SetPointTable& table = limits.table;
  const JointVector lowest = limits.lowest(machine_rad), highest = limits.highest(machine_rad);
  for (int i = 0; i < kJoints; ++i) {
    const double low = lowest[i], high = highest[i], at = message.position_rad[i];
    if (!(at >= low && at <= high)) return {ReasonCode::kSetpointRange, i, at * kDeg, (at < low ? low : high) * kDeg};
    const double rate = std::abs(message.velocity_radps[i]);
    if (!(rate <= table.rate_radps)) return {ReasonCode::kSetpointSpeed, i, rate, table.rate_radps};
  }
  return {};
}

/// Held by the end of the working range the position stands while the hand moves on, or comes back.
bool at_end(double position_rad, int joint, const SetPointLimits& limits) noexcept {
  return position_rad < limits.min_rad[joint] + kAtEnd_rad || position_rad > limits.max_rad[joint] - kAtEnd_rad;
}

/// Where the integral of the speed would be: with y the low-passed speed, T y' + y = p', so p - T y is that of y.
double explained(double position_rad, double velocity_radps) noexcept {
  return position_rad - kFilter_s * velocity_radps;
}

/// No speed that a hand has explains it.
Reason check_way(int joint, const SetPointMemory& before, const SetPointMemory& now, double dt_s,
                 const SetPointLimits& limits) noexcept {
  const double way_rad = std::abs(now.position_rad[joint] - before.position_rad[joint]);
  const double most_rad = limits.table.disagreement_rad + limits.table.rate_radps * dt_s;
  if (way_rad <= most_rad) return {};
  return {ReasonCode::kSetpointJump, joint, way_rad * kDeg, most_rad * kDeg};
}

/// The speeds that were sent do not explain it, over the last messages together. What one gap may hide is no evidence.
Reason check_agreement(int joint, const SetPointMemory& before, SetPointMemory& now, double dt_s,
                       const SetPointLimits& limits) noexcept {
  if (at_end(before.position_rad[joint], joint, limits) || at_end(now.position_rad[joint], joint, limits)) return {};
  const SetPointTable& table = limits.table;
  const double from_radps = before.velocity_radps[joint], to_radps = now.velocity_radps[joint];
  const double way_rad =
      explained(now.position_rad[joint], to_radps) - explained(before.position_rad[joint], from_radps);
  const double unexplained_rad = way_rad - dt_s * (from_radps + to_radps) / 2;
  // The mean of both ends is off by T^3 / 12 of the speed's second derivative at most, which for a hand is w^2 V. Of V,
  // the highest speed, ends and way show half at least.
  const double hand_radps = 2 * std::numbers::pi * table.hand_Hz;
  const double shown_radps =
      std::max({std::abs(from_radps), std::abs(to_radps), dt_s > 0 ? std::abs(way_rad) / dt_s : 0});
  const double hidden_rad =
      std::min(2 * shown_radps, table.rate_radps) * hand_radps * hand_radps * dt_s * dt_s * dt_s / 12;
  const double evidence_rad = std::copysign(std::max(0.0, std::abs(unexplained_rad) - hidden_rad), unexplained_rad);
  const double ahead_rad = std::exp(-dt_s / table.forget_s) * before.ahead_rad[joint] + evidence_rad;
  if (!(std::abs(ahead_rad) <= table.disagreement_rad))
    return {ReasonCode::kSetpointJump, joint, std::abs(ahead_rad) * kDeg, table.disagreement_rad * kDeg};
  now.ahead_rad[joint] = ahead_rad;
  return {};
}

}  // namespace

SetPointLimits::SetPointLimits(const MachineDescription& machine, const SetPointTable& constants) noexcept
    : table(constants) {
  for (int i = 0; i < kJoints; ++i) {
    const LinkDescription& link = machine.links[static_cast<std::size_t>(i)];
    min_rad[i] = link.min_rad;
    max_rad[i] = link.max_rad;
  }
}

JointVector SetPointLimits::lowest(const JointVector& machine_rad) const noexcept {
  return min_rad.cwiseMin(machine_rad) - JointVector::Constant(table.range_margin_rad);
}

JointVector SetPointLimits::highest(const JointVector& machine_rad) const noexcept {
  return max_rad.cwiseMax(machine_rad) + JointVector::Constant(table.range_margin_rad);
}

JointVector SetPointLimits::clamped(const JointVector& position_rad, const JointVector& machine_rad) const noexcept {
  return position_rad.cwiseMax(lowest(machine_rad)).cwiseMin(highest(machine_rad));
}

SetPointVerdict check_set_point(const MasterMessage& message, const SetPointMemory& memory,
                                const SetPointLimits& limits, const JointVector& machine_rad) noexcept {
  SetPointVerdict verdict;
  verdict.reason = check_alone(message, limits, machine_rad);
  SetPointMemory& next = verdict.memory;
  next = {!message.clutch, message.stamp.sent_at, message.position_rad, message.velocity_radps, JointVector::Zero()};
  if (!memory.known || !next.known) return verdict;

  const double dt_s = std::max(0.0, to_seconds(message.stamp.sent_at - memory.sent_at));
  for (int i = 0; i < kJoints && !verdict.reason; ++i) {
    verdict.reason = check_way(i, memory, next, dt_s, limits);
    if (!verdict.reason) verdict.reason = check_agreement(i, memory, next, dt_s, limits);
  }
  return verdict;
}

}  // namespace knuckle::slave
