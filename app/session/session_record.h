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
#include "master/master_state.h"
#include "slave/slave_state.h"

namespace knuckle::session {

/// The simulator's own, known to no controller. SI units, frame M; forces of the world on the machine.
struct Truth {
  JointVector joint_rad = JointVector::Zero(), joint_radps = JointVector::Zero();
  JointVector spool = JointVector::Zero();  ///< [-1, 1]
  PlanarVector tip_m = PlanarVector::Zero();
  PlanarVector tip_force_N = PlanarVector::Zero();  ///< Of the world incl. soil, payload excluded.
  PlanarVector contact_m = PlanarVector::Zero();    ///< Where it acts on the bucket, bucket axes; 0: nowhere.
  double pipe_N = 0;                                ///< Of it, what a buried pipe takes.
  double payload_kg = 0;
  PlanarVector weight_N = PlanarVector::Zero();  ///< Of the payload.
  double pump_flow_share = 1;                    ///< Delivered over asked flow: < 1 where the pump is short.
  double energy_to_machine_J = 0;                ///< Cumulative work of the valves' port on the machine.

  template <typename Self, typename Visit>
  static void fields(Self& s, Visit&& visit) {
    [[maybe_unused]] const auto& [joint_rad, joint_radps, spool, tip_m, tip_force_N, contact_m, pipe_N, payload_kg,
                                  weight_N, pump_flow_share, energy_to_machine_J] = s;
    visit("joint_rad", s.joint_rad);
    visit("joint_radps", s.joint_radps);
    visit("spool", s.spool);
    visit("tip_m", s.tip_m);
    visit("tip_force_N", s.tip_force_N);
    visit("contact_m", s.contact_m);
    visit("pipe_N", s.pipe_N);
    visit("payload_kg", s.payload_kg);
    visit("weight_N", s.weight_N);
    visit("pump_flow_share", s.pump_flow_share);
    visit("energy_to_machine_J", s.energy_to_machine_J);
  }
};

/// Hand and device as they are. SI units, frame D.
struct Hand {
  JointVector joint_rad = JointVector::Zero(), joint_radps = JointVector::Zero();  ///< Of the device.
  JointVector intent_rad = JointVector::Zero();                                    ///< Where the operator means to be.
  PlanarVector tip_m = PlanarVector::Zero();                                       ///< The device's.
  PlanarVector felt_N = PlanarVector::Zero();  ///< Force of the device on the hand at its tip, from true motor torque.
  double energy_J = 0;                         ///< Cumulative work of the device on the hand (net).

  template <typename Self, typename Visit>
  static void fields(Self& s, Visit&& visit) {
    [[maybe_unused]] const auto& [joint_rad, joint_radps, intent_rad, tip_m, felt_N, energy_J] = s;
    visit("joint_rad", s.joint_rad);
    visit("joint_radps", s.joint_radps);
    visit("intent_rad", s.intent_rad);
    visit("tip_m", s.tip_m);
    visit("felt_N", s.felt_N);
    visit("energy_J", s.energy_J);
  }
};

/// One step of the slave loop, and what else was so at that time.
struct Sample {
  double t_s = 0;
  slave::SlaveState machine;   ///< As the machine's side knows it.
  master::MasterState master;  ///< As the operator's side knew it last.
  Truth truth;
  Hand hand;
  PlanarVector tip_m = PlanarVector::Zero();  ///< From the measured joints with the nominal geometry, frame M.
  /// Machine tip that the hand asks for at this time (master's set-point, no delay), frame M.
  PlanarVector hand_setpoint_tip_m = PlanarVector::Zero();
  /// Largest change of the felt force in one millisecond since the last row (real time: of the force asked for).
  double felt_slew_N_per_ms = 0;
  std::uint8_t phase = 0;  ///< Of the operator's plan: index into SessionRecord::phases.

  /// In tables and digests. t_s is the machine's time.
  template <typename Self, typename Visit>
  static void fields(Self& s, Visit&& visit) {
    [[maybe_unused]] const auto& [t_s, machine, master, truth, hand, tip_m, hand_setpoint_tip_m, felt_slew_N_per_ms,
                                  phase] = s;
    visit("", s.machine);
    visit("operator", s.master);
    visit("truth", s.truth);
    visit("hand", s.hand);
    visit("tip_m", s.tip_m);
    visit("hand_setpoint_tip_m", s.hand_setpoint_tip_m);
    visit("felt_slew_N_per_ms", s.felt_slew_N_per_ms);
    visit("phase", s.phase);
  }
};

struct FaultRecord {
  Reason reason;
  double at_s = 0;                 ///< When it latched.
  double last_good_input_s = 0;    ///< In the time base of --candump.
  double command_neutral_s = 0;    ///< First zero set-point or non-ACTIVE control word on the wire; 0: never.
  double spool_neutral_s = 0;      ///< Actual spool 0x6301 inside its dead band, or the simulated one where none is
                                   ///< told; 0: never.
  bool controller_silent = false;  ///< It put nothing on the wire until the spools were neutral: no command to judge.
  std::optional<double> injected_s{};  ///< When what is taken as the cause was broken on purpose; null: nothing was.
};

/// Adds a row where there is room for it, without allocating; else counts it: a judge must know what it never saw.
template <typename Row>
void keep(std::vector<Row>& rows, const Row& row, std::uint64_t& lost) noexcept {
  if (rows.size() < rows.capacity())
    rows.push_back(row);
  else
    ++lost;
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
  double device_limit_N = 8;    ///< Largest force that the device shows
  std::vector<double> asked_N;  ///< By the operator's phase: what a press asks for (asked_forces_N()); 0: not certain
  double link_delay_s = 0;      ///< One way, as configured
  /// Where the walls begin that the hand feels at the ends of the machine's joints.
  JointVector joint_end_low_rad = JointVector::Constant(-std::numeric_limits<double>::infinity());
  JointVector joint_end_high_rad = JointVector::Constant(std::numeric_limits<double>::infinity());
  JointVector most_radps = JointVector::Ones();  ///< The joints' speed limits.
  bool plan_finished = true;                     ///< The operator came to the end of the plan.
  bool cut_short = false;                        ///< It did not, because the session was asked to end before.
  int phases_timed_out = 0;                      ///< 1 where the operator's plan did not come to its end in time
  int resumed_by_itself = 0;  ///< Faults after which a valve was commanded before enable was released and pressed again
  /// Samples, frames, events and faults there was no room for. If any: the session does not pass.
  std::uint64_t records_lost = 0;
};

}  // namespace knuckle::session
