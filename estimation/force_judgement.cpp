// What the estimator makes of its torques: how sure it is, whether something was touched, what to learn from it.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimation/force_estimator.h"
#include "estimation/length_error.h"

namespace knuckle::estimation {
namespace {

std::uint16_t doubt_of(ContactRefusal refusal) noexcept {
  switch (refusal) {
    case ContactRefusal::kStraightArm:
      return kStraightArm;
    case ContactRefusal::kBucketInLine:
      return kBucketInLine;
    case ContactRefusal::kNearToggle:
      return kNearToggle;
    case ContactRefusal::kDirectionAlongLink:
      return kDirectionAlongLink;
    case ContactRefusal::kOffTheBucket:
      return kOffTheBucket;
    case ContactRefusal::kNoDirection:
      return kNoDirection;
    case ContactRefusal::kForceTooSmall:
    case ContactRefusal::kNotFinite:
      break;
  }
  return kBadInput;
}

// Standstill: below this rod speed friction is somewhere between -F_s and +F_s.
constexpr double kStuckSpeed_mps = 2e-3;
constexpr double kStuckSpread = 0.5;  // standard deviation of stuck friction as a part of F_s
// Two speed classes of what free motion leaves, by the fastest rod.
constexpr double kFastClass_mps = 0.05;
constexpr double kRippleMemory_s = 15;
constexpr std::array<double, 2> kLeastRipple_N{35, 90};  // cylinder equivalent

// Contact logic.
constexpr double kTouch2 = 25, kClear2 = 12;  // squared Mahalanobis distances of three joint torques
// Free motion is not Gaussian: a reversal or a slow beat of an encoder goes many standard deviations out now and then.
// So a force is called significant only if it is beyond this as well, as cylinder force of each joint; slow, fast.
constexpr std::array<double, 2> kExcursion_N{100, 150};
constexpr double kClearTime_s = 0.3;
constexpr double kFreeTime_s = 1.0;      // untouched for so long: free motion
constexpr double kTurningFade_s = 0.15;  // how long a rod's turning is felt in filtered torques
constexpr double kSwingFade_s = 0.3;     // half a period of the slowest swing
// A boom that brakes hard swings on hull and steel near their own frequencies, where they yield by more than the static
// amount that is taken off. Of the torque that accelerates the masses so much is not believed (docs/theory.md).
constexpr double kSlowInertialDoubt = 0.15, kContactInertialDoubt = 0.25;
constexpr double kMoving_mps = 5e-3;

// End stops: their cushions and steel take force that shows in the pressures but is not the world's. How much is not
// known, so the joint's torque is not believed there.
constexpr double kCushion_m = 0.02, kCushion_Ns_per_m = 2e5;  // throttled end of the stroke, generous
// The cylinder may press on steel with all its pressure.
constexpr double kStop_N = 1e5;
constexpr double kStopFade_s = 0.3;
constexpr double kStopSeen_N = 300;

// Confidence.
constexpr double kBiasdAfter_s = 10;
constexpr double kUsableSigma_N = 300;
constexpr double kReliefPart = 0.97;
constexpr double kResidualSigma = 4;

JointVector equivalent_torque2(const JointVector& lever_m, double cylinder_N) {
  return (lever_m.cwiseAbs().cwiseMax(kLeastSureLever_m) * cylinder_N).array().square();
}

/// Holds on to a variance that lasts longer in filtered torques than its cause.
void hold(JointVector& variance, const JointVector& now, double faded) noexcept {
  variance = (variance * faded).cwiseMax(now);
}

std::size_t speed_class(const ObserverChannel& channel) noexcept {
  return channel.cylinder_mps.cwiseAbs().maxCoeff() > kFastClass_mps ? 1 : 0;
}

}  // namespace

int ContactCusum::step(const JointVector& torque_Nm, const JointVector& sigma_Nm) noexcept {
  high_passed_ = torque_Nm - slow_.step(torque_Nm);
  int alarm = -1;
  for (int i = 0; i < kJoints; ++i) {
    const double z = std::clamp(high_passed_[i] / sigma_Nm[i], -kClip, kClip);
    up_[i] = std::max(0.0, up_[i] + weight_ * (z - kDrift));
    down_[i] = std::max(0.0, down_[i] + weight_ * (-z - kDrift));
    if (alarm < 0 && std::max(up_[i], down_[i]) > kThreshold) alarm = i;
  }
  if (alarm >= 0) {
    up_.setZero();
    down_.setZero();
  }
  return alarm;
}

FreeSpread::FreeSpread(const JointVector& prior_variance_Nm2, double look_every_s) noexcept
    : floor_Nm2_(kSmallestPart * kSmallestPart * prior_variance_Nm2),
      moment_Nm2_(prior_variance_Nm2.asDiagonal()),
      most_updates_(kMemory_s / look_every_s) {
  solve();
}

void FreeSpread::update(const JointVector& torque_Nm, const JointVector& explained_Nm2,
                        const JointVector& variance_Nm2) noexcept {
  updates_ = std::min(updates_ + 1, most_updates_);
  const Eigen::Matrix3d before_Nm2 = moment_Nm2_;
  moment_Nm2_ += (torque_Nm * torque_Nm.transpose() - moment_Nm2_) / updates_;
  explained_Nm2_ += (explained_Nm2 - explained_Nm2_) / updates_;
  for (int i = 0; i < kJoints; ++i) {
    if (std::isfinite(variance_Nm2[i])) continue;
    moment_Nm2_.row(i) = before_Nm2.row(i);
    moment_Nm2_.col(i) = before_Nm2.col(i);
    explained_Nm2_[i] = 0;
  }
  solve();
}

void FreeSpread::solve() noexcept {
  JointVector part;
  for (int i = 0; i < kJoints; ++i) {
    const double seen = moment_Nm2_(i, i);
    const double left = std::max(seen - explained_Nm2_[i], kLeastUnexplained * seen);
    part[i] = std::sqrt(left / seen);
  }
  covariance_Nm2_ = part.asDiagonal() * moment_Nm2_ * part.asDiagonal();
  covariance_Nm2_.diagonal() = covariance_Nm2_.diagonal().cwiseMax(floor_Nm2_);
}

/// Variance of joint torque that friction may hide where a rod (almost) stands: with what the bias filter has found of
/// it, since seals may hold more than all that the drawing knows of.
JointVector ForceEstimator::stuck_variance(const ObserverChannel& channel) const noexcept {
  JointVector variance;
  for (int i = 0; i < kJoints; ++i) {
    const double slip = channel.cylinder_mps[i] / kStuckSpeed_mps;
    const double nominal_N = friction_[static_cast<std::size_t>(i)].static_N(0, pressure_sum_Pa_[i]);
    const double found_N = bias_.state()[kBiasCoulomb + i] + bias_.state()[kBiasSeal + i] * pressure_sum_Pa_[i];
    const double hidden = kStuckSpread * std::max(0.0, nominal_N + found_N) * channel.lever_m[i];
    variance[i] = std::exp(-slip * slip) * hidden * hidden;
  }
  return variance;
}

void ForceEstimator::watch_end_stops(const JointVector& joints_rad) noexcept {
  stop_variance_ *= std::exp(-step_s_ / kStopFade_s);
  const double stop_m = steel_spread_m(pins_calibrated_);
  for (int i = 0; i < kJoints; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const auto cylinder = kinematics_.cylinder_at(i, joints_rad[i]);
    if (!cylinder) continue;
    const double in = cylinder->length_m - cylinders_[k].min_length_m;
    const double out = cylinders_[k].max_length_m - cylinder->length_m;
    const double gap = std::min(in, out);
    const double closing = std::max(0.0, in < out ? -slow_.cylinder_mps[i] : slow_.cylinder_mps[i]);
    const double throttled = std::clamp(1 - gap / kCushion_m, 0.0, 1.0);
    const double steel =
        std::clamp(1 - to_steel_m(links_[k], cylinders_[k], *cylinder, joints_rad[i]) / stop_m, 0.0, 1.0);
    const double hidden_N = kCushion_Ns_per_m * throttled * throttled * closing + kStop_N * steel;
    stop_variance_[i] = std::max(stop_variance_[i], std::pow(cylinder->lever_m * hidden_N, 2));
  }
}

/// An open relief takes up to the pump's whole flow through the hose between transmitter and chamber: the pressure read
/// is off by that drop. It also ends what the cylinder can push back, so a larger force moves the machine instead.
void ForceEstimator::watch_reliefs(const JointState& state) noexcept {
  const double open_Pa = kReliefPart * hydraulics_.main_relief_Pa;
  const double drop_Pa = hydraulics_.hose_drop_Pa_per_m3ps * hydraulics_.pump_flow_m3ps;
  for (int i = 0; i < kJoints; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const CylinderDescription& cylinder = cylinders_[k];
    double hidden_N = 0;
    if (state.pressure_Pa[2 * k] > open_Pa) hidden_N = drop_Pa * cylinder.head_area_m2();
    if (state.pressure_Pa[2 * k + 1] > open_Pa) hidden_N = std::hypot(hidden_N, drop_Pa * cylinder.rod_side_area_m2());
    relief_variance_[i] = std::pow(state.lever_m[i] * hidden_N, 2);
  }
}

/// Half a step of every encoder, shaken at a channel's edge: the most that its steps can do to the torque.
/// Near one step per sample the error of a wire encoder is no noise but a slow beat.
JointVector ForceEstimator::encoder_shake_Nm(const Pose& pose, const JointVector& lever_m,
                                             const ChannelBand& band) const noexcept {
  const JointVector per_lever = lever_m.cwiseAbs().cwiseMax(kLeastSureLever_m).cwiseInverse();
  const JointVector half_step = (0.5 * length_step_m_).cwiseProduct(per_lever);
  const double edge = 2.0 * std::numbers::pi * band.observer_Hz;
  return edge * edge * joint_torque(arm_.momentum(pose, absolute(half_step)) * parameters_);
}

/// What the bias filter has not learned, in this pose + what free motion of this speed class leaves beside that + what
/// stuck friction, end stops and reliefs hide + what wrong levers and angles make of the force itself.
void ForceEstimator::update_covariance(const Pose& pose, const PlanarJacobian& jacobian,
                                       const PerJoint<bool>& known) noexcept {
  hold(stuck_variance_, stuck_variance(slow_), std::exp(-step_s_ / kTurningFade_s));
  const JointVector inertial_Nm = kSlowInertialDoubt * slow_.observer.inertial_Nm();
  hold(slow_swing_variance_, inertial_Nm.cwiseAbs2(), std::exp(-step_s_ / kSwingFade_s));
  const BiasColumns h = signals_.columns();
  const Eigen::Matrix3d from_bias_Nm2 = h * bias_.covariance() * h.transpose();
  const JointVector momentary = stuck_variance_ + stop_variance_ + relief_variance_;
  const double length_m = pins_calibrated_ ? kCalibratedLength_m : kNominalLength_m;
  const JointVector lever = signals_.lever.cwiseAbs().cwiseMax(kLeastSureLever_m);
  const JointVector reach = jacobian.colwise().norm();
  const JointVector proportional = (length_m * estimate_.tip_N.norm()) * reach.cwiseQuotient(lever);
  const Eigen::Matrix3d& spread = free_spread_[speed_class(slow_)].covariance_Nm2();
  estimate_.joint_covariance_Nm2 = from_bias_Nm2 + spread;
  estimate_.joint_covariance_Nm2.diagonal() += momentary + proportional.cwiseAbs2();
  forget_torques(estimate_.joint_covariance_Nm2, known);
  estimate_.rod_mps = slow_.cylinder_mps;
  estimate_.lever_m = signals_.lever;
  estimate_.turned_lever_m = signals_.lever_dahl;
  estimate_.measurement_variance_Nm2 = spread.diagonal() + momentary;
  estimate_.stuck_variance_Nm2 = stuck_variance_;
  forget_torques(estimate_.measurement_variance_Nm2, known);
  estimate_.bias_variance_Nm2 = from_bias_Nm2.diagonal();
  Eigen::Matrix3d generous = estimate_.joint_covariance_Nm2;
  generous.diagonal() += equivalent_torque2(signals_.lever, kExcursion_N[speed_class(slow_)]) +
                         0.5 * encoder_shake_Nm(pose, slow_.lever_m, kSlowBand).cwiseAbs2();
  // A contact that is known is no swing in free air.
  if (!estimate_.contact) generous.diagonal() += slow_swing_variance_;
  mahalanobis2_ = estimate_.joint_torque_Nm.dot(torque_weight(generous) * estimate_.joint_torque_Nm);
}

/// Touched: the contact channel stepped, or the slow one is larger than all that is uncertain about it. A press that
/// grows too slowly for either is not learned while the rods stand still, which they do on anything stiff.
void ForceEstimator::judge_contact() noexcept {
  const std::size_t now = speed_class(contact_.motion);
  hold(turning_variance_, stuck_variance(contact_.motion), std::exp(-step_s_ / kTurningFade_s));
  const JointVector inertial_Nm = kContactInertialDoubt * contact_.motion.observer.inertial_Nm();
  hold(swing_variance_, inertial_Nm.cwiseAbs2(), std::exp(-step_s_ / kSwingFade_s));
  const JointVector variance = free_ripple_[now] + turning_variance_ + swing_variance_ + stop_variance_;
  // Taking a load into account is no event, so it is left in here.
  const int alarm = cusum_.step(of_known(estimate_.contact_torque_Nm + estimate_.carried_Nm), variance.cwiseSqrt());
  estimate_.significant = mahalanobis2_ > kTouch2 && !free_motion_certain_;
  if (alarm >= 0 || estimate_.significant) {
    estimate_.contact = true;
    untouched_s_ = 0;
    bias_.discard();
  } else if (mahalanobis2_ < kClear2 || free_motion_certain_ || !estimate_.contact) {
    untouched_s_ += step_s_;
  }
  if (untouched_s_ > kClearTime_s) estimate_.contact = false;
  // Of what free motion shakes, alarms are no sign: with a spread too small they would keep it from being learned.
  quiet_s_ = mahalanobis2_ < kClear2 ? quiet_s_ + step_s_ : 0;
  if (quiet_s_ < kFreeTime_s) return;
  const JointVector floor = equivalent_torque2(signals_.lever, kLeastRipple_N[now]);
  JointVector& ripple = free_ripple_[now];
  ripple = (ripple + step_s_ / kRippleMemory_s * (cusum_.high_passed_Nm().cwiseAbs2() - ripple)).cwiseMax(floor);
}

void ForceEstimator::learn() noexcept {
  since_update_s_ += step_s_;
  if (maybe_loaded_) bias_.discard();
  if (maybe_loaded_ || since_update_s_ < BiasFilter::kUpdateEvery_s || untouched_s_ < kFreeTime_s ||
      slow_.cylinder_mps.cwiseAbs().maxCoeff() < kMoving_mps)
    return;
  since_update_s_ = 0;
  bias_.update({signals_, raw_residual_Nm_, estimate_.measurement_variance_Nm2});
  free_spread_[speed_class(slow_)].update(estimate_.joint_torque_Nm, estimate_.bias_variance_Nm2,
                                          estimate_.measurement_variance_Nm2);
}

void ForceEstimator::judge_confidence(const ContactAnswer& answer) noexcept {
  double confidence = 1;
  std::uint16_t reasons = 0;
  const auto lower = [&](std::uint16_t why, double factor) {
    reasons = static_cast<std::uint16_t>(reasons | why);
    confidence *= factor;
  };
  if (answer.sigma_N > kUsableSigma_N) lower(kNearSingular, kUsableSigma_N / answer.sigma_N);
  if (!all_torques_known(estimate_.joint_covariance_Nm2)) lower(kTorqueMissing, 1);
  if (answer.refusal) lower(doubt_of(*answer.refusal), 1);
  confidence *= answer.share;
  if (slow_.cylinder_mps.cwiseAbs().maxCoeff() < kStuckSpeed_mps) lower(kStuckFriction, 0.9);
  if (slow_.cylinder_mps.cwiseAbs().maxCoeff() > kFastClass_mps) lower(kFastMotion, 0.9);
  if (bias_.learned_s() < kBiasdAfter_s) lower(kBiasNotLearned, 0.7 + 0.3 * bias_.learned_s() / kBiasdAfter_s);
  if (estimate_.residual_sigma > kResidualSigma) lower(kResidual, kResidualSigma / estimate_.residual_sigma);
  if ((stop_variance_.array() > equivalent_torque2(signals_.lever, kStopSeen_N).array()).any()) lower(kEndStop, 0.5);
  if (relief_variance_.maxCoeff() > 0) lower(kReliefOpen, 0.8);
  estimate_.confidence = confidence;
  estimate_.confidence_reasons = reasons;
}

}  // namespace knuckle::estimation
