// The last thing before the wire: every valve command passes here, whoever made it. Pure function; it trusts neither
// the controller nor the mode machine to have looked at ages, ranges or limits.
#pragma once

#include <array>
#include <cstdint>

#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "machine/description.h"
#include "machine/kinematics.h"
#include "transport/link_messages.h"

namespace knuckle::slave {

/// Limits that no machine file can loosen.
struct GateTable {
  double command = 1.0;            ///< [of stroke] A valve has no more.
  double away_1ps = 5.0;           ///< [of stroke/s] Opening further: full in 0.2 s. Closing is never limited:
                                   ///< stopping must not wait.
  Duration longest_step = 20ms;    ///< Rate credit of one step at most: a late loop gets no bigger jump.
  Duration setpoint_age = 200ms;   ///< Neutral by then (loss of link).
  double range_stop_s = 0.10;      ///< Outward joint speed may be what is left of the range over this: valve delay
                                   ///< plus spool closing time.
  double wall_stop_s = 0.15;       ///< Likewise for the tip at a virtual wall.
  double pressure_band_Pa = 10e5;  ///< Opening fades to zero over the last 10 bar: no chatter on sensor noise.
};
inline constexpr GateTable kGateTable{};

/// The table plus what the machine file says, ready for use.
struct GateLimits {
  explicit GateLimits(const MachineDescription& machine, const GateTable& constants = kGateTable);
  GateTable table;
  Duration state_age;                               ///< From the file: sensor age limit.
  JointVector min_rad, max_rad;                     ///< Working range.
  JointVector dead_band_extend, dead_band_retract;  ///< Openings below these move nothing.
  JointVector flow_per_root_Pa;                     ///< Valve flow at full opening = this * sqrt(drop) [m3/s/sqrt(Pa)].
  JointVector head_area_m2, rod_side_area_m2;
  LimitsDescription file;
  double load_sensing_margin_Pa, pump_flow_m3ps;
  Kinematics kinematics;
};

/// What the gate believes of the machine: raw angles, levers and pressures with the age of the oldest of them.
struct GateState {
  bool valid = false;
  JointVector angle_rad = JointVector::Zero();
  JointVector lever_m = JointVector::Zero();
  std::array<double, 6> pressure_Pa{};
  Time oldest_at = kNever;       ///< Arrival of the oldest sensor value behind this state ...
  std::uint8_t oldest_node = 0;  ///< ... and who sent it.
};

struct GateMemory {
  JointVector sent = JointVector::Zero();
  Time at = kNever;
};

struct GateResult {
  JointVector commands = JointVector::Zero();  ///< What may go on the wire, [-1, 1], positive = extend.
  std::uint16_t limits = 0;                    ///< LimitFlag bits: nothing is limited silently.
  Reason fault;                                ///< Neutral because of this; the mode machine must latch it.
  Reason limiting;                             ///< First limit that is worth telling the operator.
  GateMemory memory;
};

/// @param wanted valve commands per joint.
/// @param setpoint_at when the operator set-point behind them came in.
[[nodiscard]] GateResult safety_gate(const JointVector& wanted, Mode mode, Time setpoint_at, const GateState& state,
                                     const GateMemory& memory, const GateLimits& limits, Time now) noexcept;

}  // namespace knuckle::slave
