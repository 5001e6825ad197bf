#include "slave/slave_state.h"

#include <cmath>

#include "slave/slave_loop.h"

namespace knuckle::slave {

SlaveState state_of(Time now, const SlaveLoop& slave) noexcept {
  SlaveState state;
  const estimation::ForceEstimate& force = slave.force();
  state.at = now;
  state.mode = slave.mode();
  state.blocking = slave.blocking();
  state.fault = slave.fault();
  state.limits = slave.limits();
  state.operational = slave.client().operational();
  state.pilot_on = slave.pilot_on();
  state.e_stop_open = slave.e_stop_open();
  if (const auto measurement = slave.sensors().measurement()) {
    state.measured = true;
    state.pressure_Pa = measurement->pressure_Pa;
    state.cylinder_m = measurement->cylinder_m;
    state.hull_pitch_rad = measurement->hull_pitch_rad;
  }
  state.readings = slave.sensors().readings(now);
  state.oldest_node = slave.sensors().oldest_node();
  state.oldest_age_s = age_s(slave.sensors().oldest_at(), now);
  state.joint_rad = slave.newest_state().angle_rad;
  state.joint_radps = slave.newest_state().rate_radps;
  const MasterMessage& asked = slave.operator_input().message();
  state.heard = slave.operator_input().message_at() != kNever;
  state.presence = asked.presence;
  state.enable = asked.enable;
  state.clutch = asked.clutch;
  state.stop = asked.stop;
  state.device_ok = asked.device_ok;
  state.device = asked.device_reason;
  state.setpoint_rad = asked.position_rad;
  state.setpoint_radps = asked.velocity_radps;
  state.rendered_N = asked.rendered_N;
  state.assist_force_limit_N = asked.assist.force_limit_N;
  state.assist_stop_on_object = asked.assist.stop_on_object;
  state.message_age_s = age_s(slave.operator_input().message_at(), now);
  state.round_trip_s = to_seconds(slave.operator_input().round_trip());
  state.late_s = to_seconds(slave.operator_input().session().late());
  state.authority = slave.operator_input().set_point().authority;
  state.malformed_datagrams = slave.operator_input().malformed();
  state.torque_Nm = force.joint_torque_Nm;
  state.fast_torque_Nm = force.fast_torque_Nm;
  state.tip_force_N = force.tip_N;
  state.load_N = force.loaded_tip_N - force.tip_N;
  state.covariance_N2 = {force.covariance_N2(0, 0), force.covariance_N2(0, 1), force.covariance_N2(1, 1)};
  state.confidence = slave.confidence();
  state.residual_sigma = force.residual_sigma;
  state.confidence_reasons = force.confidence_reasons;
  state.contact_model = force.contact_model;
  for (std::size_t i = 0; i < kJoints; ++i)
    if (!slave.newest_state().pressures_known[i]) state.unknown_torques |= static_cast<std::uint8_t>(1U << i);
  state.tip_torque_Nm = force.tip_torque_Nm;
  state.tip_torque_sigma_Nm = std::sqrt(force.tip_torque_variance_N2m2);
  state.force_torque_covariance_N2m = {force.force_torque_covariance_N2m[0], force.force_torque_covariance_N2m[1]};
  state.line_offset_m = force.line.offset_m;
  state.line_sigma_m = force.line.sigma_m;
  state.touched_share = force.touched_share;
  state.contact = force.contact;
  state.home_offered = slave.home().offered();
  state.home_on_two = slave.home().chosen();
  state.payload_kg = slave.payload().kg();
  state.payload_sigma_kg = slave.payload().sigma_kg();
  state.contact_compliance = slave.control_output().contact_compliance;
  state.energy_in_J = slave.energy_in_J();
  state.ahead_rad = slave.control_output().ahead_rad;
  state.wanted = slave.wanted();
  state.valve_command = slave.commands();
  state.spool = slave.spool();
  return state;
}

SlaveMessage message_of(const SlaveState& state) noexcept {
  SlaveMessage message;
  message.mode = state.mode;
  message.blocking = state.blocking;
  message.fault = state.fault;
  message.limits = state.limits;
  message.position_rad = state.joint_rad;
  message.velocity_radps = state.joint_radps;
  message.pressure_Pa = state.pressure_Pa;
  message.ahead_rad = state.ahead_rad;
  message.tip_force_N = state.tip_force_N;
  message.load_N = state.load_N;
  message.covariance_N2 = state.covariance_N2;
  message.confidence = state.confidence;
  message.contact = state.contact;
  message.home_offered = state.home_offered;
  message.home_on_two = state.home_on_two;
  message.contact_compliance = state.contact_compliance;
  message.tip_torque_Nm = state.tip_torque_Nm;
  message.tip_torque_sigma_Nm = state.tip_torque_sigma_Nm;
  message.force_torque_covariance_N2m = state.force_torque_covariance_N2m;
  message.touched_share = state.touched_share;
  message.unknown_torques = state.unknown_torques;
  message.payload_kg = state.payload_kg;
  message.payload_sigma_kg = state.payload_sigma_kg;
  return message;
}

}  // namespace knuckle::slave
