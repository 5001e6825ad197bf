#include "slave/joint_control.h"

#include <algorithm>
#include <cmath>

#include "core/trust.h"
#include "machine/oil_stiffness.h"
#include "transport/link_messages.h"

namespace knuckle::slave {
namespace {

constexpr double kAccelerationLead_s = 0.1;  // covers valve delay and spool lag in free motion
constexpr double kLeadFade = 0.6;            // tip force at which the lead is gone, of the feed-forward's
constexpr double kRemembered_s = 3;          // a contact that is touched no more, or only lightly
constexpr double kPumpShare = 0.95;          // of the pump's flow, kept back for leakage and errors of gain
constexpr double kFadeInTip_mps = 0.01;      // dead-band compensation grows over this tip speed
constexpr double kLearnBelow_mps = 0.002;    // cylinder speed under which the dead band is learned
constexpr double kLearnAsked_mps = 0.006;    // asked speed above which a standstill is lag, not dead band
constexpr double kLearnDelay_s = 0.05;       // from command to delivered oil
constexpr double kLearnFilter_Hz = 3;
constexpr double kVelocityFilter_Hz = 6;  // of the hand's speed fed forward: valves cannot follow its tremor
constexpr double kAccelerationFilter_Hz = 3;
// Of the pressures that the valve gain is compensated for: below the arm's swinging on its oil (2 to 3 Hz as measured).
// A fixed opening lets less oil through where the pressure rises, which damps that swing; a gain that follows the
// swinging pressure takes the damping away, and as late as valves are, drives it.
constexpr double kLoadFilter_Hz = 1.2;
constexpr double kGivenWay_Hz = 0.3;     // below all that swings: what the oil gives way to a load is no swing
constexpr double kIdle_mps = 1e-6;       // in contact 0.1 mm/s already presses: the pump is not idle then
constexpr double kLeastDrop_Pa = 3e5;    // the gain never divides by less than this over both edges
constexpr double kGateTolerance = 0.02;  // change by the gate (rate limit) up to which the dead band is still learned
constexpr double kDither_s = 0.01;       // before it changes sides
constexpr double kBack_m = 0.1;          // from where it touched: further off the way back may meet something else
constexpr double kMoves_mps = 5e-3, kCame_s = 0.3;  // of the tip, until its way counts; memory of that way
constexpr double kSoftLimitGain_1ps = 2.5;          // speed allowed towards a joint limit per radian before it

}  // namespace

JointControl::Learning::Learning(double step_s) noexcept
    : wanted_1(kLearnFilter_Hz, step_s, 0),
      wanted_2(kLearnFilter_Hz, step_s, 0),
      delivered_1(kLearnFilter_Hz, step_s, 0),
      delivered_2(kLearnFilter_Hz, step_s, 0) {}

JointControl::JointControl(const MachineDescription& machine, double step_s)
    : machine_(machine),
      kinematics_(machine),
      law_(machine),
      step_s_(step_s),
      dither_steps_(
          std::max(machine.bus.set_point_every_nth_sync,
                   static_cast<int>(std::lround(std::max(kDither_s, machine.bus.joint_period_s()) / step_s)))),
      supply_Pa_(machine.hydraulics.load_sensing_margin_Pa),
      load_(kLoadFilter_Hz, step_s, Load::Zero()),
      velocity_(kVelocityFilter_Hz, step_s, JointVector::Zero()),
      acceleration_(kAccelerationFilter_Hz, step_s, JointVector::Zero()),
      given_way_rad_(kGivenWay_Hz, step_s, JointVector::Zero()),
      ahead_(step_s),
      rising_to_ceiling_(step_s, kCeilingLimits),
      rising_to_assist_(step_s),
      contact_compliance_(step_s),
      learning_{Learning(step_s), Learning(step_s), Learning(step_s)} {}

void JointControl::reset() noexcept {
  running_ = false;
  velocity_.reset(JointVector::Zero());
  acceleration_.reset(JointVector::Zero());
  rising_to_ceiling_.reset();
  rising_to_assist_.reset();
  contact_compliance_.reset();
  touched_m_.setZero();
  contact_probability_ = 0;
  ahead_.reset(JointVector::Zero());
  learning_.fill(Learning(step_s_));
  supply_Pa_ = machine_.hydraulics.load_sensing_margin_Pa;
}

/// A joint on its oil is a spring that hardly damps itself: x'' = w^2 (u - x) - 2 z w x', u the oil let in. A speed
/// that follows the error of x makes it swing where the gain is above 2 z w, and both fall with the cylinder's lever:
/// with 7 cm of lever a 20 t machine's bucket swings at 1.5 Hz from a gain of 0.3 on. The error of u has no such bound.
JointVector JointControl::swing_rad(const estimation::JointState& state) noexcept {
  JointVector behind_rad = JointVector::Zero();
  for (int i = 0; i < kJoints; ++i)
    if (state.pressures_known[static_cast<std::size_t>(i)])
      behind_rad[i] = given_way_rad(machine_, kinematics_, i, state.angle_rad[i], state.cylinder_N[i]);
  if (!running_) given_way_rad_.reset(behind_rad);
  return behind_rad - given_way_rad_.step(behind_rad);
}

JointVector JointControl::fed_forward(const Touch& touch, const PlanarVector& force_N, double fade, double held,
                                      const JointVector& towards_radps) const noexcept {
  const JointVector& velocity = velocity_.value();
  const PlanarVector normal = force_N.stableNormalized();
  const double leaving_mps = normal.dot(touch.tip_jacobian * velocity);
  const double pressing_mps = -normal.dot(touch.tip_jacobian * towards_radps);
  const double away_mps = (1 - held) * std::max(0.0, leaving_mps - std::max(0.0, pressing_mps));
  const double back_mps = held * std::max(0.0, touch.normal.dot(touch.jacobian * velocity));
  return (1 - fade) * law_.slowed_radps(velocity, touch, touch.normal * back_mps) +
         fade * (law_.to_joints(touch.tip_jacobian) * (normal * away_mps));
}

JointVector JointControl::wanted_rates(const estimation::JointState& state, const Touch& touch,
                                       const estimation::ForceEstimate& force, const JointCommand& command,
                                       Output& output) noexcept {
  const auto& control = machine_.control;
  // A model that refuses tells no force: what holds the machine back in a contact must not go with it.
  const PlanarVector pressed_N =
      force.contact_model == ContactModel::kBucketForce ? force.tip_N : PlanarVector(touch.force_N);
  const double tip_force = pressed_N.norm();
  // Fed forward into a wall, the set-point's speed would press; soil and loads go along with it, and away it only
  // helps.
  if (touch.jacobian.allFinite()) {
    touched_m_ += step_s_ * (touch.jacobian * state.rate_radps);
    output.contact_compliance = contact_compliance_.step(touched_m_, pressed_N);
  } else {
    contact_compliance_.reset();  // nobody knows where it is touched
  }
  const double fade = (1 - output.contact_compliance) * std::min(1.0, tip_force / control.feed_forward_fade_N);
  const double lead = kAccelerationLead_s * std::max(0.0, 1.0 - tip_force / (kLeadFade * control.feed_forward_fade_N));
  const JointVector before = velocity_.value();
  velocity_.step(command.velocity_radps);
  acceleration_.step((velocity_.value() - before) / step_s_);

  JointVector gain = JointVector::Constant(control.position_gain_1ps);
  gain[kBucket] = control.bucket_position_gain_1ps;
  const JointVector ahead_rad = command.position_rad - state.angle_rad, compliance_rad = law_.compliance_rad(touch);
  const bool assisted = command.force_limit_N > 0 && command.force_limit_N < machine_.limits.tip_force_N;
  const double most_N = assisted ? command.force_limit_N : machine_.limits.tip_force_N;
  // A contact that was certain stays so while it is touched: a limit that comes and goes with the force makes it swing.
  const double probability_now = law_.contact_probability(touch, most_N);
  contact_probability_ = std::max(probability_now, contact_probability_ - step_s_ / kRemembered_s);
  const double contact_probability = std::max(
      probability_now, contact_probability_ * std::min(1.0, touch.force_N.norm() / control.feed_forward_fade_N));
  const JointVector limited_lead_rad = law_.limited_lead_rad(ahead_rad, touch, command.rendered_N, most_N,
                                                             contact_probability, output.contact_compliance);
  JointVector error_rad = limited_lead_rad + compliance_rad;
  if (machine_.bus.command_kind == CommandKind::kJointRate) error_rad -= swing_rad(state);
  const JointVector towards = law_.steadied_radps(gain.cwiseProduct(error_rad), touch, state);
  // The limited set-point stands still until the hand has come back to it.
  const double cut_m = touch.normal.dot(touch.jacobian * (limited_lead_rad - ahead_rad));
  const double held = std::clamp(cut_m * control.tip_stiffness_N_per_m / control.feed_forward_fade_N, 0.0, 1.0);
  if (cut_m > 0 && touch.normal.dot(command.rendered_N) + control.feed_forward_fade_N > most_N) {
    output.limits |= assisted ? kLimitAssistForce : kLimitForceCeiling;
    output.assist = {assisted ? ReasonCode::kAssistForce : ReasonCode::kForceCeiling, 0, touch.force_N.norm(), most_N};
  }
  const JointVector fed = fed_forward(touch, pressed_N, fade, held, towards);
  JointVector rate = towards + fed + lead * acceleration_.value();
  for (int i = 0; i < kJoints; ++i)
    rate[i] = within_limits(i, rate[i], state.angle_rad[i], command.speed_share, output.limits);
  output.ahead_rad = ahead_.step(ahead_rad);
  return shared(rate, state, output.limits);
}

double JointControl::within_limits(int joint, double rate_radps, double angle_rad, double speed_share,
                                   std::uint16_t& limits) const noexcept {
  const auto& link = machine_.links[static_cast<std::size_t>(joint)];
  const double margin = machine_.limits.joint_soft_margin_rad / 4;
  const double up = std::max(0.0, kSoftLimitGain_1ps * (link.max_rad - margin - angle_rad));
  const double down = std::max(0.0, kSoftLimitGain_1ps * (angle_rad - link.min_rad - margin));
  const double most_radps = speed_share * link.max_rate_radps;
  const double soft = std::clamp(rate_radps, -std::min(down, most_radps), std::min(up, most_radps));
  if (soft != rate_radps) limits |= std::abs(rate_radps) > most_radps ? kLimitVelocity : kLimitJointRange;
  return soft;
}

JointVector JointControl::shared(const JointVector& rate, const estimation::JointState& state,
                                 std::uint16_t& limits) const noexcept {
  const double tip_speed = (kinematics_.tip_jacobian(state.angle_rad) * rate).norm();
  double flow = 0;
  for (int i = 0; i < kJoints; ++i) {
    const auto& cylinder = machine_.cylinders[static_cast<std::size_t>(i)];
    const double v = state.lever_m[i] * rate[i];
    flow += v > 0 ? v * cylinder.head_area_m2() : -v * cylinder.rod_side_area_m2();
  }
  double scale = 1;
  if (tip_speed > machine_.limits.tip_speed_mps) {
    scale = machine_.limits.tip_speed_mps / tip_speed;
    limits |= kLimitVelocity;
  }
  const double available = kPumpShare * machine_.hydraulics.pump_flow_m3ps;
  if (flow * scale > available) {
    scale = available / flow;
    limits |= kLimitPumpFlow;
  }
  return rate * scale;
}

/// Pressures as measured; of a cylinder without transmitters those that hold the arm's weight.
JointControl::Load JointControl::load_of(const estimation::JointState& state,
                                         const estimation::ForceEstimate& force) const noexcept {
  Load load = Eigen::Map<const Load>(state.pressure_Pa.data());
  for (std::size_t i = 0; i < kJoints; ++i) {
    if (state.pressures_known[i]) continue;
    const auto& cylinder = machine_.cylinders[i];
    const double push_N = force.gravity_N[static_cast<Eigen::Index>(i)];
    const auto head = static_cast<Eigen::Index>(2 * i);
    load[head] = std::max(0.0, push_N) / cylinder.head_area_m2();
    load[head + 1] = std::max(0.0, -push_N) / cylinder.rod_side_area_m2();
  }
  return load;
}

void JointControl::update_supply(const JointVector& cylinder_mps) noexcept {
  // Load sensing: the pump holds the highest working-port pressure of the moving axes plus a margin, through a lag.
  const auto& hydraulics = machine_.hydraulics;
  double load = 0;
  for (int i = 0; i < kJoints; ++i) {
    const int side = 2 * i + (cylinder_mps[i] >= 0 ? 0 : 1);
    if (std::abs(cylinder_mps[i]) > kIdle_mps) load = std::max(load, load_.value()[side]);
  }
  const double target = std::min(load + hydraulics.load_sensing_margin_Pa, hydraulics.main_relief_Pa);
  supply_Pa_ += (target - supply_Pa_) * (1 - std::exp(-step_s_ / hydraulics.load_sensing_lag_s));
}

double JointControl::full_opening_mps(int joint, bool extend) const noexcept {
  // Both metering edges in series, steady: A_in v = K sqrt(p_s - p_in), A_out v = K sqrt(p_out - p_T), so
  // v = K sqrt((p_s A_in - p_T A_out -+ F) / (A_A^3 + A_B^3)) with F = p_A A_A - p_B A_B.
  const auto& cylinder = machine_.cylinders[static_cast<std::size_t>(joint)];
  const double head = cylinder.head_area_m2(), rod = cylinder.rod_side_area_m2();
  const double area_in = extend ? head : rod, area_out = extend ? rod : head;
  const double cylinder_N = load_.value()[2 * joint] * head - load_.value()[2 * joint + 1] * rod;
  const double load = extend ? cylinder_N : -cylinder_N;
  const double drive = std::max(supply_Pa_ * area_in - machine_.hydraulics.tank_Pa * area_out - load,
                                kLeastDrop_Pa * (area_in + area_out));
  const double k = cylinder.valve.nominal_flow_m3ps / std::sqrt(cylinder.valve.nominal_drop_Pa);
  return k * std::sqrt(drive / (head * head * head + rod * rod * rod));
}

void JointControl::learn(int joint, double wanted_mps, double full_mps, const estimation::JointState& state,
                         bool learning) noexcept {
  auto& memory = learning_[static_cast<std::size_t>(joint)];
  const int delay = std::min(kDelaySteps - 1, static_cast<int>(std::lround(kLearnDelay_s / step_s_)));
  const auto now = steps_ % kDelaySteps;
  const auto then = (steps_ + kDelaySteps - static_cast<std::uint32_t>(delay)) % kDelaySteps;
  memory.wanted_mps[now] = wanted_mps;
  // What the valve delivered, also against a wall: extension plus compression of the oil.
  const double length = kinematics_.cylinder_at(joint, state.angle_rad[joint]).value_or(CylinderState{}).length_m;
  const auto& cylinder = machine_.cylinders[static_cast<std::size_t>(joint)];
  const double delivered =
      length + state.cylinder_N[joint] / oil_stiffness_N_per_m(cylinder, machine_.hydraulics, length);
  const double rate = running_ ? (delivered - memory.delivered_m) / step_s_ : 0.0;
  memory.delivered_m = delivered;
  const double wanted = memory.wanted_2.step(memory.wanted_1.step(memory.wanted_mps[then]));
  const double got = memory.delivered_2.step(memory.delivered_1.step(rate));
  if (!learning || std::abs(state.cylinder_mps[joint]) > kLearnBelow_mps || std::abs(wanted) > kLearnAsked_mps) return;
  const double direction = wanted >= 0 ? 1 : -1;
  auto& correction = learned_[static_cast<std::size_t>(joint)][wanted >= 0 ? 0 : 1];
  const double bound = machine_.control.learning_limit;
  correction = std::clamp(correction + step_s_ * (wanted - got) * direction / full_mps, -bound, bound);
}

double JointControl::spool_command(int joint, double wanted_mps, const estimation::JointState& state,
                                   bool learning) noexcept {
  const auto i = static_cast<std::size_t>(joint);
  const auto& valve = machine_.cylinders[i].valve;
  const auto& control = machine_.control;
  const bool extend = wanted_mps >= 0;
  const double full = full_opening_mps(joint, extend);
  learn(joint, wanted_mps, full, state, learning);
  const double dead_band = valve.dead_band(extend);
  const double fill = control.dead_band_fill * dead_band + learned_[i][extend ? 0 : 1];
  const double fade_mps = std::abs(state.lever_m[joint]) * kFadeInTip_mps / control.stiffness_radius_m[joint];
  const double fade_in = std::clamp(wanted_mps / std::max(fade_mps, 1e-5), -1.0, 1.0);
  const double opening = std::copysign(valve.opening_for(std::abs(wanted_mps) / full, extend), wanted_mps);
  const double dither =
      (steps_ / static_cast<std::uint32_t>(dither_steps_)) % 2 == 0 ? control.dither : -control.dither;
  return std::clamp(fill * fade_in + (1 - dead_band) * opening + dither, -1.0, 1.0);
}

double JointControl::rate_command(int joint, double rate_radps, bool extend) const noexcept {
  const double share = std::abs(rate_radps) / machine_.bus.full_rate_radps(joint, extend);
  return std::copysign(std::min(share, 1.0), extend ? 1.0 : -1.0);
}

void JointControl::limit_force(const Touch& touch, const estimation::ForceEstimate& force, double assist_N,
                               Output& output) noexcept {
  const PlanarVector force_N = raw_tip_force(touch.tip_jacobian, force);
  const auto limit = [&](RisingForce& rising, double limit_N, const AssistLimits& limits, LimitFlag flag) {
    TipContact contact = rising.step(force_N);
    contact.direction_trust = trust(force.confidence);
    const LimitedApproach approach = limit_approach(output.rate_radps, touch.jacobian, contact, limit_N, limits);
    output.rate_radps = approach.rate_radps;
    if (!approach.limiting) return;
    output.assist = approach.limiting;
    output.limits |= flag;
  };
  limit(rising_to_ceiling_, machine_.limits.tip_force_N, kCeilingLimits, kLimitForceCeiling);
  limit(rising_to_assist_, assist_N, kAssistLimits, kLimitAssistForce);
}

JointControl::Output JointControl::step(const estimation::JointState& state, const estimation::ForceEstimate& force,
                                        const JointCommand& command, const JointVector& sent_valve_last) noexcept {
  Output output;
  if (!command.active) {
    reset();
    return output;
  }
  const Touch touch = law_.touch(state, force);
  output.rate_radps = wanted_rates(state, touch, force, command, output);
  limit_force(touch, force, command.force_limit_N, output);
  const PlanarVector tip_mps = touch.tip_jacobian * state.rate_radps;
  from_touch_m_ += step_s_ * tip_mps;
  if (!force.contact) {
    from_touch_m_.setZero();
    if (tip_mps.norm() > kMoves_mps) came_mps_ += step_s_ / kCame_s * (tip_mps - came_mps_);
  } else if (!estimation::all_torques_known(force.joint_covariance_Nm2)) {
    // In free air too, a machine that is not calibrated would stand still nearly everywhere (docs/theory.md).
    // As it is in motion: friction of rods at rest would keep the machine where this limit has stopped it.
    Eigen::Matrix3d moving_Nm2 = force.joint_covariance_Nm2;
    moving_Nm2.diagonal() -= force.stuck_variance_Nm2;
    const PlanarVector back_mps = from_touch_m_.norm() < kBack_m ? came_mps_ : PlanarVector(PlanarVector::Zero());
    const LimitedApproach seen = limit_unseen(output.rate_radps, touch.tip_jacobian, moving_Nm2, back_mps);
    output.rate_radps = seen.rate_radps;
    if (!output.assist) output.assist = seen.limiting;
  }
  const JointVector cylinder_mps = state.lever_m.cwiseProduct(output.rate_radps);
  if (machine_.bus.command_kind == CommandKind::kJointRate) {
    for (int i = 0; i < kJoints; ++i) output.valve[i] = rate_command(i, output.rate_radps[i], cylinder_mps[i] > 0);
    running_ = true;
    return output;
  }
  if (!running_) load_.reset(load_of(state, force));
  load_.step(load_of(state, force));
  update_supply(cylinder_mps);
  for (int i = 0; i < kJoints; ++i) {
    const bool passed = std::abs(sent_valve_last[i] - last_valve_[i]) < kGateTolerance;
    const bool known = state.pressures_known[static_cast<std::size_t>(i)];  // else its oil's compression is not
    output.valve[i] = spool_command(i, cylinder_mps[i], state, running_ && passed && known);
  }
  last_valve_ = output.valve;
  running_ = true;
  ++steps_;
  return output;
}

}  // namespace knuckle::slave
