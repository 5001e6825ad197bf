// Whether a hand can have made the operator's set-point: each message by itself and against the one before, before
// anything acts on it. Pure.
#pragma once

#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "machine/description.h"
#include "transport/link_messages.h"

namespace knuckle::slave {

/// Limits that no machine file can loosen. Angles and rates are machine joints'.
struct SetPointTable {
  /// Beyond the working range: the operator's side keeps set-points inside it; one degree is left for rounding.
  double range_margin_rad = 0.0175;
  /// A hand that goes for something moves with frequencies of up to 9.2 Hz (J. V. Draper, IEEE Trans. SMC 24, 1994).
  double hand_Hz = 9.2;
  /// At that frequency a finger that swings by 20 deg to each side turns at 20 rad/s, which is 1 m/s at the end of a
  /// link of 5 cm; a machine joint at twice that where the console sets twice the device's own position scale.
  double rate_radps = 40;
  /// What position and speed may disagree by: 5 deg, as much as hand and machine may when the machine is engaged.
  /// Reports of the device come late, its encoders count in steps, and its firmware filters the speed once more.
  double disagreement_rad = 0.0873;
  /// Older disagreement is forgotten over this: a speed that is not that of the position is found from 0.44 rad/s on,
  /// the bound over this time.
  double forget_s = 0.2;
};
inline constexpr SetPointTable kSetPointTable{};

struct SetPointLimits {
  explicit SetPointLimits(const MachineDescription& machine, const SetPointTable& constants = kSetPointTable) noexcept;
  /// The nearest set-point within the range that a message may have while the machine stands at machine_rad.
  [[nodiscard]] JointVector clamped(const JointVector& position_rad, const JointVector& machine_rad) const noexcept;
  /// That range: the working range, out to where the machine stands if it is beyond, since it must be led back from
  /// there (the gate lets nothing move further out), and the margin.
  [[nodiscard]] JointVector lowest(const JointVector& machine_rad) const noexcept;
  [[nodiscard]] JointVector highest(const JointVector& machine_rad) const noexcept;
  SetPointTable table;
  JointVector min_rad, max_rad;  ///< Working range.
};

/// The message before, and by how much positions ran ahead of what the speeds explain.
struct SetPointMemory {
  bool known = false;
  Time sent_at{};
  JointVector position_rad = JointVector::Zero(), velocity_radps = JointVector::Zero();
  JointVector ahead_rad = JointVector::Zero();
};

struct SetPointVerdict {
  Reason reason;  ///< kSetpointRange, kSetpointSpeed or kSetpointJump with the joint; none where a hand can do that.
  SetPointMemory memory;
};

/// @param machine_rad measured joint angles; within the working range they make no difference.
/// @param message finite, as decoded. With the clutch held, and after it, a set-point may be anywhere: only its range
/// and speed are judged then.
[[nodiscard]] SetPointVerdict check_set_point(const MasterMessage& message, const SetPointMemory& memory,
                                              const SetPointLimits& limits, const JointVector& machine_rad) noexcept;

}  // namespace knuckle::slave
