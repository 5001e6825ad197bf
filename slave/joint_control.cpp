#include "slave/joint_control.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "transport/link_messages.h"

namespace knuckle::slave {
namespace {

constexpr double kAccelerationLead_s = 0.1;  // covers valve delay and spool lag in free motion
constexpr double kLeadFade = 0.6;            // tip force at which the lead is gone, of the feed-forward's
constexpr double kPumpShare = 0.95;          // of the pump's flow, kept back for leakage and errors of gain
constexpr double kFadeInTip_mps = 0.01;      // dead-band compensation grows over this tip speed
constexpr double kLearnBelow_mps = 0.002;    // cylinder speed under which the dead band is learned
constexpr double kLearnAsked_mps = 0.006;    // asked speed above which a standstill is lag, not dead band
constexpr double kLearnDelay_s = 0.05;       // from command to delivered oil
constexpr double kLearnFilter_Hz = 3;
constexpr double kVelocityFilter_Hz = 6;  // of the hand's speed fed forward: valves cannot follow its tremor
constexpr double kAccelerationFilter_Hz = 3;
constexpr double kLeastDrop_Pa = 3e5;  // the gain never divides by less than this over both edges
constexpr double kSingularity = 0.02;  // of J W J^T (about 0.5 in both directions where the arm is well bent)
constexpr double kNoTrust = 0.1, kFullTrust = 0.4;  // confidence between which giving way fades in, as the felt force
constexpr double kLargestPress = 10;     // force given way to, of the feed-forward's fade: no press needs more
constexpr double kGateTolerance = 0.02;  // change by the gate (rate limit) up to which the dead band is still learned
constexpr double kSoftLimitGain_1ps = 2.5;  // speed allowed towards a joint limit per radian before it

double clamp_abs(double value, double bound) noexcept {
  return std::clamp(value, -bound, bound);
}

}  // namespace

JointControl::Learning::Learning(double step_s) noexcept
    : wanted_1(kLearnFilter_Hz, step_s, 0),
      wanted_2(kLearnFilter_Hz, step_s, 0),
      delivered_1(kLearnFilter_Hz, step_s, 0),
      delivered_2(kLearnFilter_Hz, step_s, 0) {}

JointControl::JointControl(const MachineDescription& machine, double step_s)
    : machine_(machine),
      kinematics_(machine),
      step_s_(step_s),
      valve_divider_(machine.bus.valve_every_nth_sync),
      supply_Pa_(machine.hydraulics.load_sensing_margin_Pa),
      velocity_(kVelocityFilter_Hz, step_s, JointVector::Zero()),
      acceleration_(kAccelerationFilter_Hz, step_s, JointVector::Zero()),
      ahead_(step_s),
      rising_(step_s),
      yielding_(step_s),
      learning_{Learning(step_s), Learning(step_s), Learning(step_s)} {}

void JointControl::reset() noexcept {
  running_ = false;
  velocity_.reset(JointVector::Zero());
  acceleration_.reset(JointVector::Zero());
  rising_.reset();
  yielding_.reset();
  ahead_.reset(JointVector::Zero());
}

Eigen::Matrix<double, 3, 2> JointControl::tip_to_joints(const Eigen::Matrix<double, 2, 3>& jacobian) const noexcept {
  const JointVector weight = machine_.control.stiffness_radius_m.cwiseAbs2().cwiseInverse();
  const Eigen::Matrix<double, 3, 2> weighted = weight.asDiagonal() * jacobian.transpose();
  const Eigen::Matrix2d normal = jacobian * weighted + kSingularity * Eigen::Matrix2d::Identity();
  return weighted * normal.inverse();
}

JointVector JointControl::fed_forward(const estimation::JointState& state, const PlanarVector& force_N, double fade,
                                      const JointVector& towards_radps) const noexcept {
  const JointVector& velocity = velocity_.value();
  const Eigen::Matrix<double, 2, 3> jacobian = kinematics_.tip_jacobian(state.angle_rad);
  const PlanarVector away = force_N.stableNormalized();
  const double leaving_mps = away.dot(jacobian * velocity), pressing_mps = -away.dot(jacobian * towards_radps);
  const double away_mps = std::max(0.0, leaving_mps - std::max(0.0, pressing_mps));
  return (1 - fade) * velocity + fade * (tip_to_joints(jacobian) * (away * away_mps));
}

JointVector JointControl::wanted_rates(const estimation::JointState& state, const estimation::ForceEstimate& force,
                                       const JointCommand& command, Output& output) noexcept {
  const auto& control = machine_.control;
  const double tip_force = force.tip_N.norm();
  // Fed forward into a wall, the set-point's speed would press; soil and loads go along with it, and away it only
  // helps.
  output.yielding = yielding_.step(kinematics_.tip(state.angle_rad), force.tip_N);
  const double fade = (1 - output.yielding) * std::min(1.0, tip_force / control.feed_forward_fade_N);
  const double lead = kAccelerationLead_s * std::max(0.0, 1.0 - tip_force / (kLeadFade * control.feed_forward_fade_N));
  const JointVector before = velocity_.value();
  velocity_.step(command.velocity_radps);
  acceleration_.step((velocity_.value() - before) / step_s_);

  const JointVector give = compliance(state, force);
  JointVector gain = JointVector::Constant(control.position_gain_1ps);
  gain[kBucket] = control.bucket_position_gain_1ps;
  const JointVector towards = gain.cwiseProduct(command.position_rad - state.angle_rad + give);
  JointVector rate = towards + fed_forward(state, force.tip_N, fade, towards) + lead * acceleration_.value();
  for (int i = 0; i < kJoints; ++i) rate[i] = within_limits(i, rate[i], state.angle_rad[i], output.limits);
  output.ahead_rad = ahead_.step(command.position_rad - state.angle_rad);
  return shared(rate, state, output.limits);
}

double JointControl::within_limits(int joint, double rate_radps, double angle_rad,
                                   std::uint16_t& limits) const noexcept {
  const auto& link = machine_.links[static_cast<std::size_t>(joint)];
  const double margin = machine_.limits.joint_soft_margin_rad / 4;
  const double up = std::max(0.0, kSoftLimitGain_1ps * (link.max_rad - margin - angle_rad));
  const double down = std::max(0.0, kSoftLimitGain_1ps * (angle_rad - link.min_rad - margin));
  const double soft = std::clamp(rate_radps, -std::min(down, link.max_rate_radps), std::min(up, link.max_rate_radps));
  if (soft != rate_radps) limits |= std::abs(rate_radps) > link.max_rate_radps ? kLimitVelocity : kLimitJointRange;
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

JointVector JointControl::compliance(const estimation::JointState& state,
                                     const estimation::ForceEstimate& force) const noexcept {
  // The tip shall give by f / Ks in every direction. Springs per joint (Kq_i = Ks L_i^2) give it a stiffness that
  // varies more than twofold with direction and pose, which the operator's spring, K_l = lambda mu Ks, cannot match.
  // So: external torque -> tip force -> tip displacement -> joints, by the pseudo-inverse weighted with 1/L_i^2;
  // regularised, so that an arm stretched towards the force gets stiff instead of wild.
  const auto& control = machine_.control;
  const Eigen::Matrix<double, 3, 2> to_joints = tip_to_joints(kinematics_.tip_jacobian(state.angle_rad));
  // Pressures that cannot be explained must not move the machine: what is not trusted is not given way to, and nothing
  // is given way to without bound.
  const double trusted = std::clamp((force.confidence - kNoTrust) / (kFullTrust - kNoTrust), 0.0, 1.0);
  PlanarVector tip_N = trusted * (to_joints.transpose() * force.fast_torque_Nm);
  tip_N *= std::min(1.0, kLargestPress * control.feed_forward_fade_N / std::max(tip_N.norm(), 1.0));
  return to_joints * tip_N / control.tip_stiffness_N_per_m;
}

void JointControl::update_supply(const estimation::JointState& state, const JointVector& cylinder_mps) noexcept {
  // Load sensing: the pump holds the highest working-port pressure of the moving axes plus a margin, through a lag.
  const auto& hydraulics = machine_.hydraulics;
  double load = 0;
  for (int i = 0; i < kJoints; ++i) {
    const auto side = static_cast<std::size_t>(2 * i + (cylinder_mps[i] >= 0 ? 0 : 1));
    if (std::abs(cylinder_mps[i]) > 1e-4) load = std::max(load, state.pressure_Pa[side]);
  }
  const double target = std::min(load + hydraulics.load_sensing_margin_Pa, hydraulics.main_relief_Pa);
  supply_Pa_ += (target - supply_Pa_) * (1 - std::exp(-step_s_ / hydraulics.load_sensing_lag_s));
}

double JointControl::full_opening_mps(int joint, bool extend, const estimation::JointState& state) const noexcept {
  // Both metering edges in series, steady: A_in v = K sqrt(p_s - p_in), A_out v = K sqrt(p_out - p_T), so
  // v = K sqrt((p_s A_in - p_T A_out -+ F) / (A_A^3 + A_B^3)) with F = p_A A_A - p_B A_B.
  const auto& cylinder = machine_.cylinders[static_cast<std::size_t>(joint)];
  const double head = cylinder.head_area_m2(), rod = cylinder.rod_side_area_m2();
  const double area_in = extend ? head : rod, area_out = extend ? rod : head;
  const double load = extend ? state.cylinder_N[joint] : -state.cylinder_N[joint];
  const double drive = std::max(supply_Pa_ * area_in - machine_.hydraulics.tank_Pa * area_out - load,
                                kLeastDrop_Pa * (area_in + area_out));
  const double k = cylinder.valve.nominal_flow_m3ps / std::sqrt(cylinder.valve.nominal_drop_Pa);
  return k * std::sqrt(drive / (head * head * head + rod * rod * rod));
}

double JointControl::oil_stiffness_N_per_m(int joint, double length_m) const noexcept {
  const auto& cylinder = machine_.cylinders[static_cast<std::size_t>(joint)];
  const double head = cylinder.head_area_m2(), rod = cylinder.rod_side_area_m2();
  const double stroke = cylinder.max_length_m - cylinder.min_length_m;
  const double s = std::clamp(length_m - cylinder.min_length_m, 0.0, stroke);
  const double hose = machine_.hydraulics.hose_volume_m3;
  return machine_.hydraulics.bulk_modulus_Pa *
         (head * head / (hose + head * s) + rod * rod / (hose + rod * (stroke - s)));
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
  const double delivered = length + state.cylinder_N[joint] / oil_stiffness_N_per_m(joint, length);
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
  const double full = full_opening_mps(joint, extend, state);
  learn(joint, wanted_mps, full, state, learning);
  const double dead_band = (extend ? valve.dead_band_extend : valve.dead_band_retract);
  const double fill = control.dead_band_fill * dead_band + learned_[i][extend ? 0 : 1];
  const double fade_mps = std::abs(state.lever_m[joint]) * kFadeInTip_mps / control.stiffness_radius_m[joint];
  const double fade_in = std::clamp(wanted_mps / std::max(fade_mps, 1e-5), -1.0, 1.0);
  const double opening = clamp_abs(wanted_mps / full, 1.0);
  const double dither =
      (steps_ / static_cast<std::uint32_t>(valve_divider_)) % 2 == 0 ? control.dither : -control.dither;
  return clamp_abs(fill * fade_in + (1 - dead_band) * opening + dither, 1.0);
}

void JointControl::limit_force(const estimation::JointState& state, const estimation::ForceEstimate& force,
                               double limit_N, Output& output) noexcept {
  const Eigen::Matrix<double, 2, 3> jacobian = kinematics_.tip_jacobian(state.angle_rad);
  TipContact contact = rising_.step(raw_tip_force(jacobian, force));
  contact.direction_trust = trust_in_direction(force);
  const LimitedApproach approach = limit_approach(output.rate_radps, jacobian, contact, limit_N);
  output.rate_radps = approach.rate_radps;
  output.assist = approach.limiting;
  if (approach.limiting) output.limits |= kLimitAssistForce;
}

JointControl::Output JointControl::step(const estimation::JointState& state, const estimation::ForceEstimate& force,
                                        const JointCommand& command, const JointVector& sent_valve_last) noexcept {
  Output output;
  if (!command.active) {
    reset();
    return output;
  }
  output.rate_radps = wanted_rates(state, force, command, output);
  if (command.force_limit_N > 0) {
    limit_force(state, force, command.force_limit_N, output);
  } else {
    rising_.reset();  // the force while it was off is no start of a rise
  }
  const JointVector cylinder_mps = state.lever_m.cwiseProduct(output.rate_radps);
  update_supply(state, cylinder_mps);
  for (int i = 0; i < kJoints; ++i) {
    const bool passed = std::abs(sent_valve_last[i] - last_valve_[i]) < kGateTolerance;
    output.valve[i] = spool_command(i, cylinder_mps[i], state, running_ && passed);
  }
  last_valve_ = output.valve;
  running_ = true;
  ++steps_;
  return output;
}

}  // namespace knuckle::slave
