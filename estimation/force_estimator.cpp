// One step of the force estimator: two momentum observers, tare, tip force, contact, confidence.
#include "estimation/force_estimator.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimation/tip_force.h"

namespace knuckle::estimation {
namespace {

constexpr double kPitchCutoff_Hz = 1;  // tilt comes in 0.1 deg steps and the hull moves slowly

// Standstill: below this rod speed friction is somewhere between -F_s and +F_s.
constexpr double kStuckSpeed_mps = 2e-3;
constexpr double kStuckSpread = 0.5;  // standard deviation of stuck friction as a part of F_s
// Two speed classes of the free-motion residual, by the fastest rod; and what to expect of it before it is measured.
constexpr double kFastClass_mps = 0.05;
constexpr std::array<double, 2> kResidualPrior_N{120, 250};
constexpr std::array<double, 2> kRipplePrior_N{60, 150};
constexpr double kSmallestLever_m = 0.05;
constexpr double kResidualMemory_s = 15;
constexpr double kSmallestSpread = 0.3;  // of the priors: a quiet minute does not make the estimator a perfect one

// Contact logic.
constexpr double kTouch2 = 25, kClear2 = 12;  // squared Mahalanobis distances of three joint torques
constexpr double kClearTime_s = 0.3;
constexpr double kFreeTime_s = 1.0;      // untouched for so long: free motion
constexpr double kTurningFade_s = 0.15;  // how long a rod's turning is felt in the high-passed torque
constexpr double kMoving_mps = 5e-3;
constexpr double kRepeats = 20;  // looks of one second tell about the same

// End stops: their cushions and steel take force that shows in the pressures but is not the world's. How much is not
// known, so the joint's torque is not believed there.
constexpr double kCushion_m = 0.02, kCushion_Ns_per_m = 2e5;  // throttled end of the stroke, generous
constexpr double kStop_m = 4e-3, kStop_N = 1e4;               // steel, with what pins and encoder may be wrong
constexpr double kJointStop_rad = 0.04;                       // beyond the working range: the linkage's own stop
constexpr double kStopFade_s = 0.3;
constexpr double kStopSeen_N = 300;

// Confidence.
constexpr double kTaredAfter_s = 10;
constexpr double kUsableSigma_N = 300;
constexpr double kReliefPart = 0.97;
constexpr double kResidualSigma = 4;

JointVector equivalent_torque2(const JointVector& lever_m, double cylinder_N) {
  return (lever_m.cwiseAbs().cwiseMax(kSmallestLever_m) * cylinder_N).array().square();
}

bool finite(const JointState& s) noexcept {
  return s.angle_rad.allFinite() && s.lever_m.allFinite() && s.cylinder_N.allFinite() &&
         std::isfinite(s.hull_pitch_rad);
}

}  // namespace

MomentumObserver::MomentumObserver(double cutoff_Hz, double step_s) noexcept
    : gain_(2.0 * std::numbers::pi * cutoff_Hz), momentum_(cutoff_Hz, step_s), imbalance_(cutoff_Hz, step_s) {}

void MomentumObserver::reset(const JointVector& momentum, const JointVector& imbalance_Nm) noexcept {
  momentum_.reset(momentum);
  imbalance_.reset(imbalance_Nm);
  external_Nm_ = imbalance_Nm;
}

const JointVector& MomentumObserver::step(const JointVector& momentum, const JointVector& imbalance_Nm) noexcept {
  external_Nm_ = gain_ * (momentum - momentum_.step(momentum)) + imbalance_.step(imbalance_Nm);
  return external_Nm_;
}

ForceEstimator::Channel::Channel(double velocity_Hz, double observer_Hz, double step_s) noexcept
    : first(velocity_Hz, step_s, JointVector::Zero()), rate(velocity_Hz, step_s), observer(observer_Hz, step_s) {
  rest();
}

/// No speed, and bristles that are not bent either way. The observer starts with the pose.
void ForceEstimator::Channel::rest() noexcept {
  first.reset(JointVector::Zero());
  rate.reset(JointVector::Zero());
  dahl = {};
}

ForceEstimator::ForceEstimator(const MachineDescription& machine, double step_s)
    : machine_(machine),
      kinematics_(machine),
      arm_(machine),
      nominal_(lumped_parameters(machine)),
      friction_{CylinderFriction(machine.cylinders[0].friction), CylinderFriction(machine.cylinders[1].friction),
                CylinderFriction(machine.cylinders[2].friction)},
      step_s_(step_s),
      pitch_(kPitchCutoff_Hz, step_s, 0.0),
      slow_(kSlowVelocity_Hz, kSlowObserver_Hz, step_s),
      fast_(kFastVelocity_Hz, kFastObserver_Hz, step_s),
      matched_first_(kSlowVelocity_Hz, step_s),
      matched_(kSlowVelocity_Hz, step_s),
      bank_(kSlowObserver_Hz, step_s),
      speeds_(kSlowObserver_Hz, step_s),
      fast_first_(kFastVelocity_Hz, step_s),
      fast_matched_(kFastVelocity_Hz, step_s),
      tare_(machine),
      cusum_(step_s) {
  // Middle of the range stands for the lever: these priors only have to be of the right size.
  const JointVector lever(0.2, 0.2, 0.1);
  for (std::size_t c = 0; c < 2; ++c) {
    free_covariance_[c] = equivalent_torque2(lever, kResidualPrior_N[c]).asDiagonal();
    free_ripple_[c] = equivalent_torque2(lever, kRipplePrior_N[c]);
  }
}

const ForceEstimate& ForceEstimator::step(const JointState& state) noexcept {
  if (!finite(state)) {
    estimate_.confidence = 0;
    estimate_.confidence_reasons |= kBadInput;
    return estimate_;
  }
  if (!started_) start(state);
  const Pose pose(state.angle_rad, pitch_.step(state.hull_pitch_rad));
  const JointVector moved = state.angle_rad - last_angle_rad_;
  last_angle_rad_ = state.angle_rad;
  move(slow_, moved, state.lever_m);
  move(fast_, moved, state.lever_m);
  estimate_.carried_Nm = load_columns(arm_.length_m(), pose) * carried_;
  slow_step(pose, state);
  fast_step(pose, state);
  watch_end_stops(state.angle_rad);
  update_covariance(pose);

  const Eigen::Matrix<double, 2, 3> jacobian = kinematics_.tip_jacobian(state.angle_rad);
  const TipForce tip = solve_tip_force(jacobian, estimate_.joint_torque_Nm, torque_covariance_);
  estimate_.tip_N = tip.force_N;
  estimate_.covariance_N2 = tip.covariance_N2;
  estimate_.residual_sigma = tip.residual_sigma;
  judge_contact();
  learn();
  judge_confidence(state);
  return estimate_;
}

void ForceEstimator::start(const JointState& state) noexcept {
  started_ = true;
  last_angle_rad_ = state.angle_rad;
  slow_.rest();
  fast_.rest();
  untouched_s_ = 0;
  tare_.discard();
  pitch_.reset(state.hull_pitch_rad);
  const Pose pose(state.angle_rad, state.hull_pitch_rad);
  Bank bank;
  bank << state.lever_m.array(), state.lever_m.cwiseProduct(state.cylinder_N).array(), kGravity_mps2 * pose.cos.array(),
      -kGravity_mps2 * pose.sin.array();
  matched_first_.reset(bank);
  matched_.reset(bank);
  bank_.reset(bank);
  speeds_.reset(Speeds::Zero());
  slow_.observer.reset(JointVector::Zero(), JointVector::Zero());
  const JointVector cylinder_Nm = state.lever_m.cwiseProduct(state.cylinder_N);
  fast_first_.reset(cylinder_Nm);
  fast_matched_.reset(cylinder_Nm);
  const JointVector imbalance = joint_torque(RigidArm::gravity(pose) * nominal_) - cylinder_Nm;
  fast_.observer.reset(JointVector::Zero(), imbalance);
  cusum_.reset(imbalance);
}

void ForceEstimator::move(Channel& channel, const JointVector& joint_step_rad, const JointVector& lever_m) noexcept {
  channel.lever_m = lever_m;
  channel.cylinder_mps = lever_m.cwiseProduct(channel.rate.step(channel.first.step(joint_step_rad / step_s_)));
  for (int i = 0; i < kJoints; ++i)
    channel.bristle[i] = channel.dahl[static_cast<std::size_t>(i)].step(channel.cylinder_mps[i], step_s_);
}

JointVector ForceEstimator::friction_N(const Channel& channel) const noexcept {
  JointVector f;
  for (int i = 0; i < kJoints; ++i)
    f[i] = friction_[static_cast<std::size_t>(i)].force_N(channel.bristle[i], channel.cylinder_mps[i]);
  return f;
}

/// Variance of joint torque that friction may hide where a rod (almost) stands.
JointVector ForceEstimator::stuck_variance(const Channel& channel) const noexcept {
  JointVector variance;
  for (int i = 0; i < kJoints; ++i) {
    const double slip = channel.cylinder_mps[i] / kStuckSpeed_mps;
    const double hidden = kStuckSpread * friction_[static_cast<std::size_t>(i)].extend.static_N * channel.lever_m[i];
    variance[i] = std::exp(-slip * slip) * hidden * hidden;
  }
  return variance;
}

/// The reported force. Everything that does not come from the velocity filter passes its twin, so that torque and
/// motion are equally late; otherwise viscous friction of 20 kN s/m makes each acceleration look like a force.
void ForceEstimator::slow_step(const Pose& pose, const JointState& state) noexcept {
  Bank now;
  now << state.lever_m.array(), state.lever_m.cwiseProduct(state.cylinder_N).array(), kGravity_mps2 * pose.cos.array(),
      -kGravity_mps2 * pose.sin.array();
  const Bank& seen = bank_.step(matched_.step(matched_first_.step(now)));
  Speeds speeds;
  speeds << state.lever_m.cwiseProduct(slow_.bristle).array(), state.lever_m.cwiseProduct(slow_.cylinder_mps).array();
  speeds_.step(speeds);
  signals_ = {seen.segment<3>(0), speeds_.value().segment<3>(0), speeds_.value().segment<3>(3), seen.segment<3>(6),
              seen.segment<3>(9)};

  const JointVector rate = absolute(slow_.rate.value());
  const JointVector momentum = joint_torque(arm_.momentum(pose, rate) * nominal_);
  const JointVector imbalance =
      joint_torque(arm_.velocity_products(pose, rate) * nominal_) + state.lever_m.cwiseProduct(friction_N(slow_));
  const JointVector gravity = signals_.gravity_x.cwiseProduct(nominal_.segment<3>(kMomentX)) +
                              signals_.gravity_z.cwiseProduct(nominal_.segment<3>(kMomentZ));
  nominal_residual_Nm_ =
      slow_.observer.step(momentum, imbalance) + joint_torque(gravity) - JointVector(seen.segment<3>(3));
  estimate_.joint_torque_Nm = nominal_residual_Nm_ + signals_.columns() * tare_.state() - estimate_.carried_Nm;
}

/// The quick one, for the slave's contact law and the contact event. Its cylinder torque is matched too: the boom
/// swings on its oil at 3-16 Hz, and torque that comes before the motion it makes would look like a contact. The tare
/// is applied to what goes in.
void ForceEstimator::fast_step(const Pose& pose, const JointState& state) noexcept {
  const JointVector rate = absolute(fast_.rate.value());
  const TareSignals signals{state.lever_m, state.lever_m.cwiseProduct(fast_.bristle),
                            state.lever_m.cwiseProduct(fast_.cylinder_mps), kGravity_mps2 * pose.cos,
                            -kGravity_mps2 * pose.sin};
  const JointVector momentum = joint_torque(arm_.momentum(pose, rate) * nominal_);
  const JointVector imbalance =
      joint_torque((RigidArm::gravity(pose) + arm_.velocity_products(pose, rate)) * nominal_) +
      state.lever_m.cwiseProduct(friction_N(fast_)) + signals.columns() * tare_.state() -
      fast_matched_.step(fast_first_.step(state.lever_m.cwiseProduct(state.cylinder_N)));
  estimate_.fast_torque_Nm = fast_.observer.step(momentum, imbalance) - estimate_.carried_Nm;
}

void ForceEstimator::watch_end_stops(const JointVector& joints_rad) noexcept {
  stop_variance_ *= std::exp(-step_s_ / kStopFade_s);
  for (int i = 0; i < kJoints; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const auto cylinder = kinematics_.cylinder_at(i, joints_rad[i]);
    if (!cylinder) continue;
    const double in = cylinder->length_m - machine_.cylinders[k].min_length_m;
    const double out = machine_.cylinders[k].max_length_m - cylinder->length_m;
    const double gap = std::min(in, out);
    const double closing = std::max(0.0, in < out ? -slow_.cylinder_mps[i] : slow_.cylinder_mps[i]);
    const double throttled = std::clamp(1 - gap / kCushion_m, 0.0, 1.0);
    const double beyond =
        std::max(machine_.links[k].min_rad - joints_rad[i], joints_rad[i] - machine_.links[k].max_rad);
    const double steel = std::clamp(std::max(1 - gap / kStop_m, beyond / kJointStop_rad), 0.0, 1.0);
    const double hidden_N = kCushion_Ns_per_m * throttled * throttled * closing + kStop_N * steel;
    stop_variance_[i] = std::max(stop_variance_[i], std::pow(cylinder->lever_m * hidden_N, 2));
  }
}

/// Half a step of every wire encoder, shaken at an observer's edge. Near one step per sample the error of a wire
/// encoder is no noise but a slow beat, so it counts in full and not by its variance in the mean.
JointVector ForceEstimator::encoder_shake_Nm(const Pose& pose, double edge_Hz) const noexcept {
  const JointVector half_step = 0.5 * machine_.sensors.encoder_step_m * slow_.lever_m.cwiseAbs().cwiseInverse();
  const double edge = 2.0 * std::numbers::pi * edge_Hz;
  return edge * edge * joint_torque(arm_.momentum(pose, absolute(half_step)) * nominal_);
}

/// Tare uncertainty in this pose + residual measured in free motion of this speed class + what stuck friction hides.
void ForceEstimator::update_covariance(const Pose& pose) noexcept {
  const double fastest = slow_.cylinder_mps.cwiseAbs().maxCoeff();
  const std::size_t speed_class = fastest > kFastClass_mps ? 1 : 0;
  stuck_variance_ = stuck_variance(slow_);
  fast_shake_Nm_ = encoder_shake_Nm(pose, kFastObserver_Hz);
  const double to_slow = kSlowObserver_Hz * kSlowObserver_Hz / (kFastObserver_Hz * kFastObserver_Hz);
  const TareColumns h = signals_.columns();
  const Eigen::Matrix3d untared = h * tare_.covariance() * h.transpose();
  const JointVector momentary = stuck_variance_ + stop_variance_ + 0.5 * (to_slow * fast_shake_Nm_).cwiseAbs2();
  torque_covariance_ = untared + free_covariance_[speed_class];
  torque_covariance_.diagonal() += momentary;
  estimate_.rod_mps = slow_.cylinder_mps;
  estimate_.lever_m = signals_.lever;
  estimate_.turned_lever_m = signals_.lever_dahl;
  estimate_.look_variance_Nm2 = free_covariance_[speed_class].diagonal() + momentary;
  estimate_.tare_variance_Nm2 = untared.diagonal();
  mahalanobis2_ = estimate_.joint_torque_Nm.dot(torque_covariance_.inverse() * estimate_.joint_torque_Nm);
}

/// Touched: the quick channel stepped, or the slow one is larger than all that is uncertain about it. A press that
/// grows too slowly for either is not learned while the rods stand still, which they do on anything stiff.
void ForceEstimator::judge_contact() noexcept {
  const std::size_t speed_class = fast_.cylinder_mps.cwiseAbs().maxCoeff() > kFastClass_mps ? 1 : 0;
  turning_variance_ = (turning_variance_ * std::exp(-step_s_ / kTurningFade_s)).cwiseMax(stuck_variance(fast_));
  const JointVector variance =
      free_ripple_[speed_class].cwiseMax(fast_shake_Nm_.cwiseAbs2()) + turning_variance_ + stop_variance_;
  // Taking a load into account is no event, so it is left in here.
  const int alarm = cusum_.step(estimate_.fast_torque_Nm + estimate_.carried_Nm, variance.cwiseSqrt());
  estimate_.significant = mahalanobis2_ > kTouch2 && !free_motion_certain_;
  if (alarm >= 0 || estimate_.significant) {
    if (!estimate_.contact) {
      JointVector::Index largest = 0;
      estimate_.joint_torque_Nm.cwiseAbs2().cwiseQuotient(torque_covariance_.diagonal()).maxCoeff(&largest);
      estimate_.contact_joint = alarm >= 0 ? alarm : static_cast<int>(largest);
    }
    estimate_.contact = true;
    untouched_s_ = 0;
    tare_.discard();
  } else if (mahalanobis2_ < kClear2 || free_motion_certain_ || !estimate_.contact) {
    untouched_s_ += step_s_;
  }
  if (untouched_s_ > kClearTime_s) {
    estimate_.contact = false;
    estimate_.contact_joint = -1;
  }
  if (untouched_s_ < kFreeTime_s) return;
  const double blend = step_s_ / kResidualMemory_s;
  const JointVector floor = equivalent_torque2(signals_.lever, kSmallestSpread * kRipplePrior_N[speed_class]);
  JointVector& ripple = free_ripple_[speed_class];
  ripple = (ripple + blend * (cusum_.high_passed_Nm().cwiseAbs2() - ripple)).cwiseMax(floor);
}

void ForceEstimator::learn() noexcept {
  since_look_s_ += step_s_;
  const double fastest = slow_.cylinder_mps.cwiseAbs().maxCoeff();
  if (maybe_loaded_) tare_.discard();
  if (maybe_loaded_ || since_look_s_ < Tare::kLookEvery_s || untouched_s_ < kFreeTime_s || fastest < kMoving_mps)
    return;
  since_look_s_ = 0;
  const std::size_t speed_class = fastest > kFastClass_mps ? 1 : 0;
  Eigen::Matrix3d& spread = free_covariance_[speed_class];
  tare_.look({signals_, nominal_residual_Nm_, kRepeats * (spread.diagonal() + stuck_variance_)});
  const JointVector floor = equivalent_torque2(signals_.lever, kSmallestSpread * kResidualPrior_N[speed_class]);
  const JointVector& left = estimate_.joint_torque_Nm;
  spread += Tare::kLookEvery_s / kResidualMemory_s * (left * left.transpose() - spread);
  spread.diagonal() = spread.diagonal().cwiseMax(floor);
}

void ForceEstimator::judge_confidence(const JointState& state) noexcept {
  double confidence = 1;
  std::uint8_t reasons = 0;
  const auto lower = [&](std::uint8_t why, double factor) {
    reasons = static_cast<std::uint8_t>(reasons | why);
    confidence *= factor;
  };
  const Eigen::Matrix2d& c = estimate_.covariance_N2;
  const double mean = 0.5 * (c(0, 0) + c(1, 1));
  const double sigma = std::sqrt(mean + std::hypot(0.5 * (c(0, 0) - c(1, 1)), c(0, 1)));
  if (sigma > kUsableSigma_N) lower(kNearSingular, kUsableSigma_N / sigma);
  if (slow_.cylinder_mps.cwiseAbs().maxCoeff() < kStuckSpeed_mps) lower(kStuckFriction, 0.9);
  if (slow_.cylinder_mps.cwiseAbs().maxCoeff() > kFastClass_mps) lower(kFastMotion, 0.9);
  if (tare_.learned_s() < kTaredAfter_s) lower(kNotTared, 0.7 + 0.3 * tare_.learned_s() / kTaredAfter_s);
  if (estimate_.residual_sigma > kResidualSigma) lower(kResidual, kResidualSigma / estimate_.residual_sigma);
  if ((stop_variance_.array() > equivalent_torque2(signals_.lever, kStopSeen_N).array()).any()) lower(kEndStop, 0.8);
  const double limit = kReliefPart * machine_.hydraulics.main_relief_Pa;
  if (std::any_of(state.pressure_Pa.begin(), state.pressure_Pa.end(), [&](double p) { return p > limit; }))
    lower(kReliefOpen, 0.8);
  estimate_.confidence = confidence;
  estimate_.confidence_reasons = reasons;
}

}  // namespace knuckle::estimation
