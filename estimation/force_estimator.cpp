// One step of the force estimator: three momentum observers, bias filter, tip force. What follows from them
// (covariance, contact, learning, confidence) is in force_judgement.cpp.
#include "estimation/force_estimator.h"

#include <cmath>
#include <utility>

#include "estimation/friction.h"
#include "machine/description.h"
#include "machine/encoder_length.h"

namespace knuckle::estimation {
namespace {

constexpr double kPitchCutoff_Hz = 1;  // tilt comes in 0.1 deg steps and the hull moves slowly

// What to expect of free motion before it is measured, cylinder equivalents; slow and fast motion.
constexpr std::array<double, 2> kResidualPrior_N{120, 250};
constexpr std::array<double, 2> kRipplePrior_N{60, 150};
constexpr double kShakePart = 0.3;  // standard deviation of the high-passed torque by the most that encoders do to it
constexpr std::array<double, 2> kCalibratedResidual{1, 2};  // of the calibration's own residual
// Middle of the range stands for the lever: these priors only have to be of the right size.
const JointVector kUsualLever_m(0.2, 0.2, 0.1);

bool finite(const JointState& s) noexcept {
  return s.angle_rad.allFinite() && s.lever_m.allFinite() && s.cylinder_N.allFinite() &&
         std::isfinite(s.hull_pitch_rad);
}

FreeSpread spread_of(const MachineDescription& machine, std::size_t speed_class) {
  JointVector prior_Nm = kUsualLever_m * kResidualPrior_N[speed_class];
  if (machine.dynamics_calibration) {
    const JointVector found_Nm = kCalibratedResidual[speed_class] * machine.dynamics_calibration->residual_rms_Nm;
    prior_Nm = (found_Nm.array() > 0).select(found_Nm, prior_Nm);
  }
  return {prior_Nm.cwiseAbs2(), BiasFilter::kUpdateEvery_s};
}

}  // namespace

Eigen::Matrix3d load_columns(const JointVector& length_m, const Pose& pose) noexcept {
  Eigen::Matrix3d columns;
  Eigen::RowVector3d row(0, -kGravity_mps2 * pose.cos[kBucket], kGravity_mps2 * pose.sin[kBucket]);
  for (int i = kBucket; i >= 0; --i) {
    if (i < kBucket) row[0] -= kGravity_mps2 * length_m[i] * pose.cos[i];
    columns.row(i) = row;
  }
  return columns;
}

ForceEstimator::ForceEstimator(const MachineDescription& machine, double step_s)
    : links_(machine.links),
      cylinders_(machine.cylinders),
      hydraulics_(machine.hydraulics),
      length_step_m_(length_steps_m(machine)),
      pins_calibrated_(machine.geometry_calibration.has_value()),
      kinematics_(machine),
      arm_(machine),
      contact_force_(machine, step_s),
      sides_(machine),
      parameters_(known_parameters(machine)),
      friction_{known_friction(machine, kBoom), known_friction(machine, kArm), known_friction(machine, kBucket)},
      step_s_(step_s),
      pitch_(kPitchCutoff_Hz, step_s, 0.0),
      vibration_(machine, step_s),
      slow_(kSlowBand, step_s, length_step_m_),
      torque_rate_(kSlowBand.observer_Hz, step_s),
      fast_(kFastBand, step_s, length_step_m_),
      contact_(kContactBand, step_s, length_step_m_),
      matched_first_(kSlowBand.velocity_Hz, step_s),
      matched_(kSlowBand.velocity_Hz, step_s),
      bank_(kSlowBand.observer_Hz, step_s),
      speeds_(kSlowBand.observer_Hz, step_s),
      bias_(machine),
      free_spread_{spread_of(machine, 0), spread_of(machine, 1)},
      free_ripple_{JointVector((kUsualLever_m * kRipplePrior_N[0]).cwiseAbs2()),
                   JointVector((kUsualLever_m * kRipplePrior_N[1]).cwiseAbs2())},
      cusum_(step_s) {}

JointVector ForceEstimator::of_known(const JointVector& torque_Nm) const noexcept {
  return estimate_.measurement_variance_Nm2.array().isFinite().select(torque_Nm, JointVector::Zero());
}

ForceEstimator::Pushes ForceEstimator::pushes_of(const JointState& state) noexcept {
  Pushes pushes;
  pushes << state.lever_m.cwiseProduct(state.cylinder_N).array(), state.pressure_sum_Pa().array();
  return pushes;
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
  vibration_.step(state.cylinder_N);
  for (ObserverChannel* channel : {&slow_, &fast_.motion, &contact_.motion})
    channel->move(moved, state.lever_m, vibration_.speed_mps(), estimate_.significant);
  estimate_.carried_Nm = load_columns(arm_.length_m(), pose) * carried_;
  pressure_sum_Pa_ = state.pressure_sum_Pa();
  inertia_kgm2_ = arm_.inertia(pose, parameters_);
  slow_step(pose, state);
  estimate_.fast_torque_Nm = quick_step(fast_, pose, state) - estimate_.carried_Nm;
  estimate_.contact_torque_Nm = quick_step(contact_, pose, state) - estimate_.carried_Nm;
  watch_end_stops(state.angle_rad);
  watch_reliefs(state);
  const PlanarJacobian jacobian = kinematics_.tip_jacobian(state.angle_rad);
  for (int i = 0; i < kJoints; ++i) {
    if (state.pressures_known[static_cast<std::size_t>(i)]) continue;
    for (JointVector* torque : {&estimate_.joint_torque_Nm, &estimate_.fast_torque_Nm, &estimate_.contact_torque_Nm})
      (*torque)[i] = 0;
    const double gravity_Nm = joint_torque(RigidArm::gravity(pose) * parameters_)[i] - estimate_.carried_Nm[i];
    const double lever_m = std::max(kLeastSureLever_m, std::abs(state.lever_m[i]));
    estimate_.gravity_N[i] = gravity_Nm / std::copysign(lever_m, state.lever_m[i]);
  }
  update_covariance(pose, jacobian, state.pressures_known);
  answer(state, jacobian);
  judge_contact();
  learn();
  judge_confidence(contact_force_.answer());
  return estimate_;
}

/// The reported force by the contact model; what law, force limits and buried-object cue look at by all torques that
/// are known, whatever the model: no limit may hang on a choice of how a force is shown.
void ForceEstimator::answer(const JointState& state, const PlanarJacobian& jacobian) noexcept {
  const Eigen::Matrix3d& covariance = estimate_.joint_covariance_Nm2;
  const ContactPose pose{state.angle_rad, state.lever_m, jacobian, pitch_.value(), jacobian * slow_.rate.value()};
  contact_force_.step(pose, estimate_.joint_torque_Nm, of_known(estimate_.joint_torque_Nm + estimate_.carried_Nm),
                      covariance);
  const ContactAnswer& told = contact_force_.answer();
  BucketLoad load = told.load;
  if (told.share < 1) {  // what is not told any more is what it may be wrong by
    const PlanarVector left_N = (1 - told.share) * load.force_N;
    load.covariance_N2 += left_N * left_N.transpose();
    load.torque_variance_N2m2 += std::pow((1 - told.share) * load.torque_Nm, 2);
    load.force_N *= told.share;
    load.torque_Nm *= told.share;
  }
  estimate_.contact_model = contact_force_.model();
  estimate_.tip_N = load.force_N;
  estimate_.loaded_tip_N = contact_force_.loaded_N();
  if (!all_torques_known(covariance)) {  // two torques do not tell where it lies; a load that was weighed is plumb
    const PlanarVector down(-std::sin(pitch_.value()), -std::cos(pitch_.value()));
    estimate_.loaded_tip_N = estimate_.tip_N + kGravity_mps2 * carried_[0] * down;
  }
  estimate_.covariance_N2 = load.covariance_N2;
  estimate_.residual_sigma = load.residual_sigma;
  estimate_.tip_torque_Nm = load.torque_Nm;
  estimate_.tip_torque_variance_N2m2 = load.torque_variance_N2m2;
  estimate_.force_torque_covariance_N2m = load.covariance_N2m;
  estimate_.line = line_of_action(load);
  estimate_.touched_share = sides_.shares(state.angle_rad, load);
  estimate_.fast_couple_Nm =
      contact_force_.bucket().couple_Nm(state.angle_rad, jacobian, estimate_.fast_torque_Nm, covariance);
  estimate_.fast_torque_Nm.array() -= estimate_.fast_couple_Nm;
}

void ForceEstimator::start(const JointState& state) noexcept {
  started_ = true;
  contact_force_.restart();
  last_angle_rad_ = state.angle_rad;
  untouched_s_ = quiet_s_ = 0;
  for (JointVector* held : {&stuck_variance_, &stop_variance_, &relief_variance_, &slow_swing_variance_,
                            &swing_variance_, &turning_variance_})
    held->setZero();
  bias_.discard();
  pitch_.reset(state.hull_pitch_rad);
  const Pose pose(state.angle_rad, state.hull_pitch_rad);
  const JointVector cylinder_Nm = state.lever_m.cwiseProduct(state.cylinder_N);
  Bank bank;
  bank << state.lever_m.array(), cylinder_Nm.array(), kGravity_mps2 * pose.cos.array(),
      -kGravity_mps2 * pose.sin.array(), state.pressure_sum_Pa().array();
  matched_first_.reset(bank);
  matched_.reset(bank);
  bank_.reset(bank);
  speeds_.reset(Speeds::Zero());
  slow_.rest();
  slow_.observer.reset(JointVector::Zero(), JointVector::Zero());
  vibration_.reset(state.cylinder_N);
  torque_rate_.reset(cylinder_Nm);
  start(fast_, pose, state);
  start(contact_, pose, state);
  // Nothing learned yet: at least what the encoders' steps must shake.
  const JointVector shake_Nm = kShakePart * encoder_shake_Nm(pose, state.lever_m, kContactBand);
  if (bias_.learned_s() == 0)
    for (JointVector& ripple : free_ripple_) ripple = ripple.cwiseMax(shake_Nm.cwiseAbs2());
  JointVector seen_Nm = joint_torque(RigidArm::gravity(pose) * parameters_) - cylinder_Nm;
  for (int i = 0; i < kJoints; ++i)
    if (!state.pressures_known[static_cast<std::size_t>(i)]) seen_Nm[i] = 0;  // as step() will say
  cusum_.reset(seen_Nm);
}

void ForceEstimator::start(QuickChannel& channel, const Pose& pose, const JointState& state) noexcept {
  const Pushes pushes = pushes_of(state);
  const JointVector cylinder_Nm = pushes.head<3>();
  channel.motion.rest();
  channel.torque_rate.reset(cylinder_Nm);
  channel.first.reset(pushes);
  channel.second.reset(pushes);
  channel.motion.observer.reset(JointVector::Zero(), joint_torque(RigidArm::gravity(pose) * parameters_) - cylinder_Nm);
}

/// The reported force. Everything that does not come from the velocity filter passes its twin, so that torque and
/// motion are equally late; otherwise viscous friction of 20 kN s/m makes each acceleration look like a force.
void ForceEstimator::slow_step(const Pose& pose, const JointState& state) noexcept {
  Bank now;
  now << state.lever_m.array(), state.lever_m.cwiseProduct(state.cylinder_N).array(), kGravity_mps2 * pose.cos.array(),
      -kGravity_mps2 * pose.sin.array(), state.pressure_sum_Pa().array();
  const Bank& late = matched_.step(matched_first_.step(now));
  const Bank& seen = bank_.step(late);
  Speeds speeds;
  const auto turned = state.lever_m.cwiseProduct(slow_.bristle).array();
  speeds << turned, state.lever_m.cwiseProduct(slow_.cylinder_mps).array(), turned * late.segment<3>(12);
  speeds_.step(speeds);
  torque_rate_.step(late.segment<3>(3));
  signals_ = {seen.segment<3>(0),
              speeds_.value().segment<3>(0),
              speeds_.value().segment<3>(3),
              speeds_.value().segment<3>(6),
              seen.segment<3>(6),
              seen.segment<3>(9),
              torque_rate_.columns(inertia_kgm2_)};

  const JointVector rate = absolute(slow_.rate.value());
  const JointVector momentum = inertia_kgm2_ * slow_.rate.value();
  const JointVector imbalance = joint_torque(arm_.velocity_products(pose, rate) * parameters_) +
                                slow_.friction_Nm(friction_, late.segment<3>(3), late.segment<3>(12));
  const JointVector gravity = signals_.gravity_x.cwiseProduct(parameters_.segment<3>(kMomentX)) +
                              signals_.gravity_z.cwiseProduct(parameters_.segment<3>(kMomentZ));
  raw_residual_Nm_ = slow_.observer.step(momentum, imbalance) + joint_torque(gravity) - JointVector(seen.segment<3>(3));
  estimate_.joint_torque_Nm = raw_residual_Nm_ + signals_.columns() * bias_.state() - estimate_.carried_Nm;
}

/// The quick ones. Their cylinder torque is matched too: the boom swings on its oil at 3-16 Hz, and torque that comes
/// before the motion it makes would look like a contact. The bias is applied to what goes in; what yields and the lag
/// come from rates, which are known better behind the observer.
JointVector ForceEstimator::quick_step(QuickChannel& channel, const Pose& pose, const JointState& state) noexcept {
  ObserverChannel& motion = channel.motion;
  const JointVector rate = absolute(motion.rate.value());
  const Pushes pushes = channel.second.step(channel.first.step(pushes_of(state)));
  const JointVector cylinder_Nm = pushes.head<3>(), pressure_sum_Pa = pushes.tail<3>();
  const JointVector turned = state.lever_m.cwiseProduct(motion.bristle);
  channel.torque_rate.step(cylinder_Nm);
  const BiasSignals signals{state.lever_m,
                            turned,
                            state.lever_m.cwiseProduct(motion.cylinder_mps),
                            turned.cwiseProduct(pressure_sum_Pa),
                            kGravity_mps2 * pose.cos,
                            -kGravity_mps2 * pose.sin};
  const JointVector momentum = inertia_kgm2_ * motion.rate.value();
  const JointVector imbalance =
      joint_torque((RigidArm::gravity(pose) + arm_.velocity_products(pose, rate)) * parameters_) +
      motion.friction_Nm(friction_, cylinder_Nm, pressure_sum_Pa) + signals.columns() * bias_.state() - cylinder_Nm;
  return motion.observer.step(momentum, imbalance) +
         channel.torque_rate.columns(inertia_kgm2_) * bias_.state().tail<kBiasUnseen>();
}

// Why the force is not known better, in words.

std::string doubt_text(std::uint16_t confidence_reasons) {
  constexpr std::array<std::pair<ConfidenceReason, const char*>, kConfidenceReasons> kWords{
      {{kBadInput, "sensor values are not usable"},
       {kNearSingular, "arm near straight or bucket near its end"},
       {kResidual, "the joints disagree: contact elsewhere than at the tip, or a sensor error"},
       {kEndStop, "a cylinder is at its end stop"},
       {kReliefOpen, "a relief valve is open"},
       {kStuckFriction, "at rest: friction hides small forces"},
       {kFastMotion, "fast motion"},
       {kBiasNotLearned, "still learning this machine's free motion"},
       {kTorqueMissing, "a cylinder's pressures are not measured"},
       {kStraightArm, "contact model: the arm is straight"},
       {kBucketInLine, "contact model: arm and bucket in line"},
       {kNearToggle, "contact model: bucket near its end"},
       {kDirectionAlongLink, "contact model: the force passes a joint"},
       {kOffTheBucket, "contact model: the force passes the bucket by"},
       {kNoDirection, "contact model: no direction before a motion"}}};
  std::string words;
  for (const auto& [bit, why] : kWords)
    if ((confidence_reasons & bit) != 0) words += (words.empty() ? "" : ", ") + std::string(why);
  return words;
}

}  // namespace knuckle::estimation
