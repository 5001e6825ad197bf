#include "app/session/loop_views.h"

#include <algorithm>

namespace knuckle::session {
namespace {

constexpr double kNotHeard_s = 1;  // from then on a person sees that the link is gone, and believes no mode any more

Hand hand_of(const HandView& view) noexcept {
  Hand hand;
  hand.joint_rad = view.truth.joint_rad;
  hand.joint_radps = view.truth.rate_radps;
  hand.intent_rad = view.intent.joint_rad;
  hand.tip_m = view.truth.tip_m;
  hand.felt_N = view.truth.felt_N;
  hand.energy_J = view.truth.energy_to_hand_J;
  return hand;
}

}  // namespace

Truth truth_of(const sim::PlantState& plant) noexcept {
  Truth truth;
  truth.joint_rad = plant.joint_rad;
  truth.joint_radps = plant.joint_radps;
  truth.spool = plant.spool;
  truth.tip_m = plant.tip_m;
  truth.tip_force_N = plant.contact_N;
  truth.contact_m = plant.contact_m;
  truth.pipe_N = plant.pipe_N.norm();
  truth.payload_kg = plant.payload_kg;
  truth.weight_N = plant.weight_N;
  truth.pump_flow_share = plant.pump_share;
  truth.energy_to_machine_J = plant.valve_work_J;
  return truth;
}

HandView view_of(const sim::HandAndDevice& hand, const sim::Operator& person, const sim::OperatorIntent& intent,
                 std::size_t phases) noexcept {
  const auto phase = std::min(static_cast<std::size_t>(person.phase()), phases - 1);
  return {hand.truth(), intent, static_cast<std::uint8_t>(person.holding() ? phases : phase)};
}

MasterView view_of(Time now, const master::MasterLoop& master) noexcept {
  MasterView view;
  view.state = state_of(now, master);
  view.ghost_rad = master.set_point().unclamped_rad();
  return view;
}

sim::OperatorView person_view(const MasterView& master, const JointVector& start_rad, const sim::HandTruth& hand,
                              int breaks) noexcept {
  const master::MasterState& known = master.state;
  sim::OperatorView view;
  view.machine_rad = known.heard ? known.machine_rad : start_rad;
  view.ghost_rad = master.ghost_rad;
  view.hand_rad = hand.joint_rad;
  view.felt_N = hand.felt_N;
  view.mode = known.heard && known.silence_s < kNotHeard_s ? known.mode : Mode::kOff;
  view.breaks = breaks;
  view.home_offered = known.home_offered;
  view.home_on_two = known.home_on_two;
  return view;
}

Sample sample_of(Time now, const slave::SlaveLoop& slave, const sim::PlantState& plant, const HandView& hand,
                 const MasterView& master, const Kinematics& kinematics) noexcept {
  Sample s;
  s.t_s = to_seconds(now);
  s.machine = state_of(now, slave);
  s.master = master.state;
  s.truth = truth_of(plant);
  s.hand = hand_of(hand);
  s.tip_m = kinematics.tip(s.machine.joint_rad);
  s.hand_setpoint_tip_m = kinematics.tip(s.master.setpoint_rad);
  s.felt_slew_N_per_ms = master.slew_N_per_ms;
  s.phase = hand.phase;
  return s;
}

}  // namespace knuckle::session
