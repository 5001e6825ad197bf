#include "app/session/loop_views.h"

#include <algorithm>

namespace knuckle::session {
namespace {

constexpr double kNotHeard_s = 1;  // from then on a person sees that the link is gone, and believes no mode any more

void put_slave(const slave::SlaveLoop& slave, Sample& s) noexcept {
  s.mode = slave.mode();
  s.blocking = slave.blocking().code;
  s.fault = slave.fault().code;
  const SlaveMessage& told = slave.sent();
  s.joint_rad = told.position_rad;
  s.joint_radps = told.velocity_radps;
  s.pressure_Pa = told.pressure_Pa;
  s.setpoint_rad = slave.master().position_rad;
  s.setpoint_radps = slave.master().velocity_radps;
  s.valve_command = slave.commands();
  const estimation::ForceEstimate& force = slave.force();
  s.tip_force_N = force.tip_N;
  s.force_cov_N2 = {force.covariance_N2(0, 0), force.covariance_N2(0, 1), force.covariance_N2(1, 1)};
  s.confidence = force.confidence;
  s.confidence_reasons = force.confidence_reasons;
  s.contact = force.contact;
  s.limits = slave.limits();
  s.payload_kg = told.payload_kg;
  s.payload_sigma_kg = told.payload_sigma_kg;
}

void put_plant(const sim::PlantState& plant, Sample& s) noexcept {
  s.truth_joint_rad = plant.joint_rad;
  s.truth_joint_radps = plant.joint_radps;
  s.truth_spool = plant.spool;
  s.truth_tip_m = plant.tip_m;
  s.truth_tip_force_N = plant.contact_N;
  s.truth_contact_m = plant.contact_m;
  s.truth_pipe_N = plant.pipe_N.norm();
  s.truth_payload_kg = plant.payload_kg;
  s.truth_weight_N = plant.weight_N;
  s.truth_pump_flow_share = plant.pump_share;
  s.truth_energy_to_machine_J = plant.valve_work_J;
}

void put_hand(const HandView& hand, Sample& s) noexcept {
  s.hand_rad = hand.truth.joint_rad;
  s.hand_radps = hand.truth.rate_radps;
  s.intent_rad = hand.intent.joint_rad;
  s.hand_tip_m = hand.truth.tip_m;
  s.felt_N = hand.truth.felt_N;
  s.hand_energy_J = hand.truth.energy_to_hand_J;
  s.phase = hand.phase;
}

}  // namespace

HandView view_of(const sim::HandAndDevice& hand, const sim::Operator& person, const sim::OperatorIntent& intent,
                 std::size_t phases) noexcept {
  const auto phase = std::min(static_cast<std::size_t>(person.phase()), phases - 1);
  return {hand.truth(), intent, static_cast<std::uint8_t>(person.holding() ? phases : phase)};
}

MasterView view_of(const master::MasterLoop& master, const JointVector& start_rad) noexcept {
  MasterView view;
  const auto& told = master.machine();
  view.mode = told && master.silence_s() < kNotHeard_s ? told->mode : Mode::kOff;
  view.machine_rad = told ? told->position_rad : start_rad;
  view.ghost_rad = master.set_point().unclamped_rad();
  view.set_point_rad = master.set_point().position_rad();
  view.sent_force_N = master.sent_force_N();
  view.round_trip_s = master.round_trip_s();
  return view;
}

sim::OperatorView person_view(const MasterView& master, const sim::HandTruth& hand, int breaks) noexcept {
  sim::OperatorView view;
  view.machine_rad = master.machine_rad;
  view.ghost_rad = master.ghost_rad;
  view.hand_rad = hand.joint_rad;
  view.felt_N = hand.felt_N;
  view.mode = master.mode;
  view.breaks = breaks;
  return view;
}

Sample sample_of(Time now, const slave::SlaveLoop& slave, const sim::PlantState& plant, const HandView& hand,
                 const MasterView& master, const Kinematics& kinematics) noexcept {
  Sample s;
  s.t_s = to_seconds(now);
  put_slave(slave, s);
  put_plant(plant, s);
  put_hand(hand, s);
  s.hand_setpoint_tip_m = kinematics.tip(master.set_point_rad);
  s.tip_m = kinematics.tip(s.joint_rad);
  s.drag_N = master.sent_force_N;
  s.rtt_s = master.round_trip_s;
  s.felt_slew_N_per_ms = master.slew_N_per_ms;
  return s;
}

}  // namespace knuckle::session
