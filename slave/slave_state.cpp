#include "slave/slave_state.h"

#include "slave/slave_loop.h"

namespace knuckle::slave {

SlaveState state_of(Time now, const SlaveLoop& slave) noexcept {
  SlaveState state;
  const SlaveMessage& told = slave.sent();
  state.at = now;
  state.mode = told.mode;
  state.blocking = told.blocking;
  state.fault = told.fault;
  state.limits = told.limits;
  state.operational = slave.client().operational();
  state.pilot_on = slave.client().pilot_on();
  state.e_stop_open = slave.client().e_stop_open();
  if (const auto measurement = slave.sensors().measurement()) {
    state.measured = true;
    state.pressure_Pa = measurement->pressure_Pa;
    state.cylinder_m = measurement->cylinder_m;
    state.hull_pitch_rad = measurement->hull_pitch_rad;
  }
  state.oldest_node = slave.sensors().oldest_node();
  state.oldest_age_s = age_s(slave.sensors().oldest_at(), now);
  state.joint_rad = told.position_rad;
  state.joint_radps = told.velocity_radps;
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
  state.torque_Nm = slave.force().joint_torque_Nm;
  state.fast_torque_Nm = slave.force().fast_torque_Nm;
  state.tip_force_N = told.tip_force_N;
  state.load_N = told.load_N;
  state.covariance_N2 = told.covariance_N2;
  state.confidence = told.confidence;
  state.residual_sigma = slave.force().residual_sigma;
  state.confidence_reasons = slave.force().confidence_reasons;
  state.contact = told.contact;
  state.payload_kg = told.payload_kg;
  state.payload_sigma_kg = told.payload_sigma_kg;
  state.contact_compliance = told.contact_compliance;
  state.energy_in_J = slave.energy_in_J();
  state.ahead_rad = told.ahead_rad;
  state.wanted = slave.wanted();
  state.valve_command = slave.commands();
  state.spool = slave.client().spool();
  return state;
}

}  // namespace knuckle::slave
