// What a session leaves behind: one row per slave step. Metrics, CSV and report are computed from this alone.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "transport/link_messages.h"

namespace knuckle::app {

/// SI units; columns named truth_ are the simulator's own and known to no controller. Forces are of the world on the
/// machine (machine side) and of the device on the hand (hand side).
struct Sample {
  double t_s = 0;
  Mode mode = Mode::kOff;
  ReasonCode blocking = ReasonCode::kNone, fault = ReasonCode::kNone;
  // machine side, as the slave knows it
  JointVector joint_rad, joint_radps, setpoint_rad, setpoint_radps;  ///< set-point: newest received from the master
  JointVector valve_command;                                         ///< After the gate, [-1, 1].
  std::array<double, 6> pressure_Pa{};
  PlanarVector tip_force_N;             ///< Estimated, frame M.
  std::array<double, 3> force_cov_N2{}; ///< xx, xz, zz
  double confidence = 0;
  std::uint8_t confidence_reasons = 0;
  bool contact = false;
  std::uint16_t limits = 0;
  double payload_kg = 0, payload_sigma_kg = 0;
  // simulated truth, machine side
  JointVector truth_joint_rad, truth_joint_radps;
  JointVector truth_spool;              ///< [-1, 1]
  PlanarVector truth_tip_m, truth_tip_force_N;  ///< frame M; contact force of the world incl. soil, payload excluded
  double truth_payload_kg = 0;
  double truth_pump_flow_share = 1;     ///< Delivered over asked flow: < 1 where the pump is short.
  double truth_energy_to_machine_J = 0; ///< Cumulative work of the valves' port on the machine.
  // hand side
  JointVector hand_rad, hand_radps;     ///< Device joints, truth.
  JointVector intent_rad;               ///< Where the operator means to be.
  PlanarVector hand_tip_m;              ///< Device tip in D scaled by nothing.
  PlanarVector hand_setpoint_tip_m;     ///< Machine tip that the hand asks for at this time (master's set-point, no delay), frame M.
  PlanarVector felt_N;                  ///< Force of the device on the hand at its tip, from true motor torque.
  PlanarVector drag_N;                  ///< Rendered force (what the law asked for), tip.
  double hand_energy_J = 0;             ///< Cumulative work of the device on the hand (net).
  double rtt_s = 0;
};

struct FaultRecord {
  Reason reason;
  double at_s = 0;               ///< When it latched.
  double last_good_input_s = 0;  ///< In the time base of --candump.
  double command_neutral_s = 0;  ///< First zero set-point or non-ACTIVE control word on the wire.
  double spool_neutral_s = 0;    ///< Actual spool 0x6301 inside its dead band.
};

/// World events worth a picture: "piece broke", "contact", "scoop", ...
struct EventRecord {
  double t_s = 0;
  std::string what;
};

struct SessionRecord {
  std::vector<Sample> samples;
  std::vector<FaultRecord> faults;
  std::vector<EventRecord> events;
};

}  // namespace knuckle::app
