// What the slave loop knew and did in its last step, as plain data: for recordings, tables and replay.
#pragma once

#include <array>
#include <cstdint>

#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "machine/contact_model.h"
#include "transport/link_messages.h"
#include "transport/machine_readings.h"

namespace knuckle::slave {

class SlaveLoop;

/// SI units; forces of the world on the machine, frame M. All zero before it is known.
struct SlaveState {
  static constexpr const char* kSchemaName = "MachineState";

  Time at{};  ///< Of the step.
  Mode mode = Mode::kOff;
  Reason blocking, fault;
  std::uint16_t limits = 0;  ///< LimitFlag bits.
  // Nodes on the bus.
  bool operational = false, pilot_on = false, e_stop_open = false;
  // Sensors: raw values; whose pressure or length is the oldest, and how old.
  bool measured = false;  ///< Every sensor has been heard.
  std::array<double, 6> pressure_Pa{};
  JointVector cylinder_m = JointVector::Zero();
  double hull_pitch_rad = 0;
  MachineReadings readings;
  std::uint8_t oldest_node = 0;
  double oldest_age_s = 0;
  // Joints.
  JointVector joint_rad = JointVector::Zero(), joint_radps = JointVector::Zero();
  // The operator's newest message.
  bool heard = false, presence = false, enable = false, clutch = false, stop = false, device_ok = false;
  Reason device;
  JointVector setpoint_rad = JointVector::Zero(), setpoint_radps = JointVector::Zero();
  PlanarVector rendered_N = PlanarVector::Zero();
  double assist_force_limit_N = 0;
  bool assist_stop_on_object = false;
  // The link.
  double message_age_s = 0, round_trip_s = 0, late_s = 0;
  double authority = 0;  ///< Of the loss policy, [0, 1].
  std::uint32_t malformed_datagrams = 0;
  // The force.
  JointVector torque_Nm = JointVector::Zero(), fast_torque_Nm = JointVector::Zero();
  PlanarVector tip_force_N = PlanarVector::Zero(), load_N = PlanarVector::Zero();
  std::array<double, 3> covariance_N2{};  ///< xx, xz, zz
  double confidence = 0, residual_sigma = 0;
  std::uint16_t confidence_reasons = 0;  ///< estimation::ConfidenceReason bits.
  ContactModel contact_model = ContactModel::kBucketForce;
  std::uint8_t unknown_torques = 0;  ///< Joints whose cylinder's pressures nobody measures: 1 boom, 2 arm, 4 bucket.
  double tip_torque_Nm = 0, tip_torque_sigma_Nm = 0;    ///< About the tip.
  std::array<double, 2> force_torque_covariance_N2m{};  ///< Of force x, z and that torque.
  /// How far the force's line of action passes the tip, positive to the left of the force; both 0 without a force.
  double line_offset_m = 0, line_sigma_m = 0;
  std::array<double, 6>
      touched_share{};  ///< Probability of each side of the bucket's outline: estimation::kBucketSideNames.
  bool contact = false;
  bool home_offered = false, home_on_two = false;  ///< As in SlaveMessage.
  double payload_kg = 0, payload_sigma_kg = 0;
  double contact_compliance = 0, energy_in_J = 0;
  // The valves.
  JointVector ahead_rad = JointVector::Zero();
  JointVector wanted = JointVector::Zero();         ///< Before the gate, [-1, 1].
  JointVector valve_command = JointVector::Zero();  ///< After it.
  JointVector spool = JointVector::Zero();          ///< SlaveLoop::spool()

  template <typename Self, typename Visit>
  static void fields(Self& s, Visit&& visit) {
    [[maybe_unused]] const auto& [at, mode, blocking, fault, limits, operational, pilot_on, e_stop_open, measured,
                                  pressure_Pa, cylinder_m, hull_pitch_rad, readings, oldest_node, oldest_age_s,
                                  joint_rad, joint_radps, heard, presence, enable, clutch, stop, device_ok, device,
                                  setpoint_rad, setpoint_radps, rendered_N, assist_force_limit_N, assist_stop_on_object,
                                  message_age_s, round_trip_s, late_s, authority, malformed_datagrams, torque_Nm,
                                  fast_torque_Nm, tip_force_N, load_N, covariance_N2, confidence, residual_sigma,
                                  confidence_reasons, contact_model, unknown_torques, tip_torque_Nm,
                                  tip_torque_sigma_Nm, force_torque_covariance_N2m, line_offset_m, line_sigma_m,
                                  touched_share, contact, home_offered, home_on_two, payload_kg, payload_sigma_kg,
                                  contact_compliance, energy_in_J, ahead_rad, wanted, valve_command, spool] = s;
    visit("time_ns", s.at);
    visit("mode", s.mode);
    visit("blocking", s.blocking);
    visit("fault", s.fault);
    visit("limits", s.limits);
    visit("operational", s.operational);
    visit("pilot_on", s.pilot_on);
    visit("e_stop_open", s.e_stop_open);
    visit("measured", s.measured);
    visit("pressure_Pa", s.pressure_Pa);
    visit("cylinder_m", s.cylinder_m);
    visit("hull_pitch_rad", s.hull_pitch_rad);
    visit("readings", s.readings);
    visit("oldest_node", s.oldest_node);
    visit("oldest_age_s", s.oldest_age_s);
    visit("joint_rad", s.joint_rad);
    visit("joint_radps", s.joint_radps);
    visit("heard", s.heard);
    visit("presence", s.presence);
    visit("enable", s.enable);
    visit("clutch", s.clutch);
    visit("stop", s.stop);
    visit("device_ok", s.device_ok);
    visit("device", s.device);
    visit("setpoint_rad", s.setpoint_rad);
    visit("setpoint_radps", s.setpoint_radps);
    visit("rendered_N", s.rendered_N);
    visit("assist_force_limit_N", s.assist_force_limit_N);
    visit("assist_stop_on_object", s.assist_stop_on_object);
    visit("message_age_s", s.message_age_s);
    visit("round_trip_s", s.round_trip_s);
    visit("late_s", s.late_s);
    visit("authority", s.authority);
    visit("malformed_datagrams", s.malformed_datagrams);
    visit("torque_Nm", s.torque_Nm);
    visit("fast_torque_Nm", s.fast_torque_Nm);
    visit("tip_force_N", s.tip_force_N);
    visit("load_N", s.load_N);
    visit("covariance_N2", s.covariance_N2);
    visit("confidence", s.confidence);
    visit("residual_sigma", s.residual_sigma);
    visit("confidence_reasons", s.confidence_reasons);
    visit("contact_model", s.contact_model);
    visit("unknown_torques", s.unknown_torques);
    visit("tip_torque_Nm", s.tip_torque_Nm);
    visit("tip_torque_sigma_Nm", s.tip_torque_sigma_Nm);
    visit("force_torque_covariance_N2m", s.force_torque_covariance_N2m);
    visit("line_offset_m", s.line_offset_m);
    visit("line_sigma_m", s.line_sigma_m);
    visit("touched_share", s.touched_share);
    visit("contact", s.contact);
    visit("home_offered", s.home_offered);
    visit("home_on_two", s.home_on_two);
    visit("payload_kg", s.payload_kg);
    visit("payload_sigma_kg", s.payload_sigma_kg);
    visit("contact_compliance", s.contact_compliance);
    visit("energy_in_J", s.energy_in_J);
    visit("ahead_rad", s.ahead_rad);
    visit("wanted_valve", s.wanted);
    visit("valve", s.valve_command);
    visit("spool", s.spool);
  }
};

/// After a step at `now`. Allocates nothing.
[[nodiscard]] SlaveState state_of(Time now, const SlaveLoop& slave) noexcept;
/// What of it the operator's side is told, but for the stamp, the sensors' time and the pressures: where there is no
/// measurement, the sender tells those of its last one.
[[nodiscard]] SlaveMessage message_of(const SlaveState& state) noexcept;

}  // namespace knuckle::slave
