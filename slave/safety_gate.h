// The last check before the wire: every valve command that is not neutral comes out of one of two functions,
// safety_gate() for a machine that is led, jog_gate() for first motions, before joint angles are known. (An orderly
// stop sends neutral commands only.) Pure functions; they check ages, ranges and limits themselves, whatever
// controller, mode machine or plan have checked before.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

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
  Duration longest_step = 20ms;    ///< away_1ps counts for at most this: a late loop gets no bigger jump.
  Duration setpoint_age = 200ms;   ///< Neutral by then (loss of link).
  double range_stop_s = 0.10;      ///< Outward joint speed may be what is left of the range over this: valve delay
                                   ///< plus spool closing time.
  double wall_stop_s = 0.15;       ///< Likewise for the tip at a virtual wall.
  double own_controller_s = 0.1;   ///< From a command frame to the valves of a machine with a controller of its own.
  double home = 0.3;               ///< Of stroke and of each joint's speed, where a cylinder's transmitters failed.
  double pressure_band_Pa = 10e5;  ///< Opening fades to zero over the last 10 bar: no chatter on sensor noise.
};
inline constexpr GateTable kGateTable{};

/// Limits of first motions, in no file either: not yet known is what moves, which way, and from which opening on.
struct JogTable {
  double command = 0.35;         ///< [of stroke] A slow motion on any machine; more is refused, not limited.
  double away_1ps = 0.2;         ///< [of stroke/s] Opening further: twice the steepest ramp of commissioning.
  double other_travel_m = 0.01;  ///< Of a cylinder that was not commanded.
  Duration longest = 90s;
};
inline constexpr JogTable kJogTable{};

/// The table plus what the machine file says, ready for use.
struct GateLimits {
  explicit GateLimits(const MachineDescription& machine, const GateTable& constants = kGateTable);
  GateTable table;
  JogTable jog = kJogTable;
  Duration state_age;            ///< From the file: sensor age limit.
  Duration longest_gap;          ///< From the file: the valves' own watchdog.
  JointVector min_rad, max_rad;  ///< Working range.
  JointVector max_rate_radps;
  PerJoint<bool>
      pressures_measured;  ///< As the file says; a state without one of them is of a machine on its way home.
  PerJoint<ValveDescription> valve;
  /// On top of GateTable's stopping times, where the machine's own controller is told: its frames' period, and its own
  /// lag.
  double frames_stop_s = 0;
  /// Where the command is the joint's speed: at the full one, for cylinders that retract and extend; else empty.
  std::optional<std::array<JointVector, 2>> full_rate_radps;
  JointVector head_area_m2, rod_side_area_m2;
  LimitsDescription file;
  double load_sensing_margin_Pa, pump_flow_m3ps, main_relief_Pa;
  Kinematics kinematics;
};

/// What the gate believes of the machine: raw angles, levers and pressures with the age of the oldest of them. The
/// slope's age is SensorSet::fault()'s.
struct GateState {
  bool valid = false;
  JointVector angle_rad = JointVector::Zero();
  JointVector lever_m = JointVector::Zero();
  std::array<double, 6> pressure_Pa{};
  /// false: nobody measures the cylinder's pressures. Then relief valves alone bound them, and the pump is taken to be
  /// at its own. Where the file says that they are measured, all opens and moves by at most GateTable::home.
  PerJoint<bool> pressures_known{true, true, true};
  Time oldest_at = kNever;          ///< Arrival of the oldest pressure or length behind this state ...
  std::uint8_t oldest_subject = 0;  ///< ... and what a reason about it names.
};

/// What jog_gate() believes: raw values, none of them compared with another.
struct JogState {
  static constexpr int kNoJoint = -1;
  int joint = 0;                                  ///< The one that is to move, or kNoJoint.
  bool pilot = false;                             ///< Pilot pressure is asked for: a spool that sticks moves the arm.
  Time since = kNever;                            ///< Start of the motion.
  JointVector travelled_m = JointVector::Zero();  ///< By the encoders, since pilot pressure or the motion began.
  std::array<double, 6> pressure_Pa{};
  Time oldest_at = kNever;           ///< Arrival of the oldest sensor value, a slope's later by tilt_extra_age() ...
  std::uint8_t oldest_subject = 0;   ///< ... and what a reason about it names.
  std::uint8_t invalid_subject = 0;  ///< Likewise of a sensor that reports its value as invalid; 0: none.
  bool e_stop_open = false;
};

/// Commands that passed a gate; only a gate makes them. Default ones are neutral.
class PassedCommands {
 public:
  PassedCommands() noexcept = default;
  [[nodiscard]] const JointVector& value() const noexcept { return value_; }  ///< [-1, 1], positive = extend.
  [[nodiscard]] double operator[](int joint) const noexcept { return value_[joint]; }
  [[nodiscard]] friend bool operator==(const PassedCommands& passed, const JointVector& value) noexcept {
    return passed.value_ == value;
  }

 private:
  friend class GateLimiter;
  explicit PassedCommands(const JointVector& value) noexcept : value_(value) {}
  JointVector value_ = JointVector::Zero();
};

struct GateMemory {
  JointVector sent = JointVector::Zero();
  Time at = kNever;
};

struct GateResult {
  PassedCommands commands;   ///< What may go on the wire.
  std::uint16_t limits = 0;  ///< LimitFlag bits: nothing is limited silently.
  Reason fault;              ///< Neutral because of this; the mode machine must latch it.
  Reason limiting;           ///< First limit that is worth telling the operator.
  GateMemory memory;
};

/// @param wanted valve commands per joint.
/// @param setpoint_at when the operator set-point behind them came in.
[[nodiscard]] GateResult safety_gate(const JointVector& wanted, Mode mode, Time setpoint_at, const GateState& state,
                                     const GateMemory& memory, const GateLimits& limits, Time now) noexcept;

/// Passes `wanted` while sensors, pressures and cylinders are within their limits. Otherwise the result is neutral with
/// one of the faults kCommandInvalid, kEmergencyStop, kLoopOverrun, kJogTooLong, kSensorInvalid, kSensorStale,
/// kJogOtherMoves, kPressureLimit. Neutral without a request for pilot pressure always passes.
/// @param wanted zero for all joints but one.
[[nodiscard]] GateResult jog_gate(const JointVector& wanted, const JogState& state, const GateMemory& memory,
                                  const GateLimits& limits, Time now) noexcept;

}  // namespace knuckle::slave
