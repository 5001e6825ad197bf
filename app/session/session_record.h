// What a session leaves behind: one row per slave step. Metrics, CSV and report are computed from this alone.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "transport/link_messages.h"

namespace knuckle::session {

/// SI units; columns named truth_ are the simulator's own and known to no controller. Forces are of the world on the
/// machine (machine side) and of the device on the hand (hand side).
struct Sample {
  double t_s = 0;
  Mode mode = Mode::kOff;
  ReasonCode blocking = ReasonCode::kNone, fault = ReasonCode::kNone;

  // Machine side, as the slave knows it.
  JointVector joint_rad = JointVector::Zero();
  JointVector joint_radps = JointVector::Zero();
  JointVector setpoint_rad = JointVector::Zero();  ///< Newest received from the master.
  JointVector setpoint_radps = JointVector::Zero();
  JointVector valve_command = JointVector::Zero();  ///< After the gate, [-1, 1].
  std::array<double, 6> pressure_Pa{};
  PlanarVector tip_m = PlanarVector::Zero();        ///< From the measured joints with the nominal geometry, frame M.
  PlanarVector tip_force_N = PlanarVector::Zero();  ///< Estimated, frame M.
  std::array<double, 3> force_cov_N2{};             ///< xx, xz, zz
  double confidence = 0;
  std::uint8_t confidence_reasons = 0;  ///< ConfidenceReason bits.
  bool contact = false;
  std::uint16_t limits = 0;  ///< LimitFlag bits.
  double payload_kg = 0, payload_sigma_kg = 0;

  // Simulated truth, machine side.
  JointVector truth_joint_rad = JointVector::Zero();
  JointVector truth_joint_radps = JointVector::Zero();
  JointVector truth_spool = JointVector::Zero();          ///< [-1, 1]
  PlanarVector truth_tip_m = PlanarVector::Zero();        ///< Frame M.
  PlanarVector truth_tip_force_N = PlanarVector::Zero();  ///< Frame M; of the world incl. soil, payload excluded.
  PlanarVector truth_contact_m = PlanarVector::Zero();    ///< Where it acts on the bucket, bucket axes; 0: nowhere.
  double truth_pipe_N = 0;                                ///< Of it, what a buried pipe takes.
  double truth_payload_kg = 0;
  PlanarVector truth_weight_N = PlanarVector::Zero();  ///< Of the payload, frame M.
  double truth_pump_flow_share = 1;                    ///< Delivered over asked flow: < 1 where the pump is short.
  double truth_energy_to_machine_J = 0;                ///< Cumulative work of the valves' port on the machine.

  // Hand side.
  JointVector hand_rad = JointVector::Zero();  ///< Device joints, truth.
  JointVector hand_radps = JointVector::Zero();
  JointVector intent_rad = JointVector::Zero();    ///< Where the operator means to be.
  PlanarVector hand_tip_m = PlanarVector::Zero();  ///< Device tip in D scaled by nothing.
  /// Machine tip that the hand asks for at this time (master's set-point, no delay), frame M.
  PlanarVector hand_setpoint_tip_m = PlanarVector::Zero();
  PlanarVector felt_N = PlanarVector::Zero();  ///< Force of the device on the hand at its tip, from true motor torque.
  PlanarVector drag_N = PlanarVector::Zero();  ///< Rendered force (what the law asked for), tip.
  double hand_energy_J = 0;                    ///< Cumulative work of the device on the hand (net).
  double rtt_s = 0;
  std::uint8_t phase = 0;         ///< Of the operator's plan: index into SessionRecord::phases.
  double felt_slew_N_per_ms = 0;  ///< Largest change of the felt force in one millisecond since the last row (real
                                  ///< time: of the force asked for).
};

struct FaultRecord {
  Reason reason;
  double at_s = 0;                 ///< When it latched.
  double last_good_input_s = 0;    ///< In the time base of --candump.
  double command_neutral_s = 0;    ///< First zero set-point or non-ACTIVE control word on the wire; 0: never.
  double spool_neutral_s = 0;      ///< Actual spool 0x6301 inside its dead band; 0: never.
  bool controller_silent = false;  ///< It put nothing on the wire until the spools were neutral: no command to judge.
  std::optional<double> injected_s{};  ///< When what is taken as the cause was broken on purpose; null: nothing was.
};

/// Adds a row where there is room for it, without allocating; else counts it: a judge must know what it never saw.
template <typename Row>
void keep(std::vector<Row>& rows, const Row& row, std::uint64_t& lost) noexcept {
  rows.size() < rows.capacity() ? rows.push_back(row) : void(++lost);
}

/// The operator was told that less is felt than the machine feels.
struct WarningRecord {
  Reason reason;
  double at_s = 0;
};

/// World events to be drawn: "piece broke", "contact", "scoop", ...
struct EventRecord {
  double t_s = 0;
  std::string what;
};

struct SessionRecord {
  std::vector<Sample> samples;
  std::vector<FaultRecord> faults;
  std::vector<double> injected_s;  ///< When something was broken on purpose, whether or not it became a fault.
  std::vector<EventRecord> events;
  std::vector<WarningRecord> warnings;
  /// Names of the operator's phases. Metrics know "press" and "hold" (means to touch) and "weigh"; others are free.
  std::vector<std::string> phases;
  double force_scale = 1e-3;    ///< lambda: hand newtons per machine newton
  std::vector<double> asked_N;  ///< By the operator's phase: what a press asks for (asked_force.h); 0: nothing certain
  double link_delay_s = 0;      ///< One way, as configured
  /// Where the walls begin that the hand feels at the ends of the machine's joints.
  JointVector joint_end_low_rad = JointVector::Constant(-std::numeric_limits<double>::infinity());
  JointVector joint_end_high_rad = JointVector::Constant(std::numeric_limits<double>::infinity());
  bool plan_finished = true;  ///< The operator came to the end of the plan.
  bool cut_short = false;     ///< It did not, because the session was asked to end before.
  int phases_timed_out = 0;   ///< 1 where the operator's plan did not come to its end in time
  int resumed_by_itself = 0;  ///< Faults after which a valve was commanded before enable was released and pressed again
  /// Samples, frames, events and faults there was no room for. If any: the session does not pass.
  std::uint64_t records_lost = 0;
};

}  // namespace knuckle::session
