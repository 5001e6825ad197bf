// Normal equations of the payload's fit, with fading memory and priors, and the start of lifts.
#include "estimation/payload.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimation/regressor.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::estimation {
namespace {

constexpr double kSlowest_mps = 5e-3, kFastest_mps = 0.1;  // of the rods: moving, but slowly
constexpr double kConstant_N = 30, kDirection_N = 40;      // what the bias filter leaves, per cylinder
constexpr double kPlace_m = 0.1;                           // standard deviation of where a load lies
constexpr double kLeastLoad_kg = 10;                       // for the prior of its moments
constexpr double kLeastResidual_N = 60;                    // residual of one update, cylinder equivalent
constexpr double kUpdatesPerIndependent = 40;              // updates within two seconds tell about the same
// A lift starts where the mean innovation of about half a second passes this many standard deviations.
constexpr double kSurprise = 4, kSurpriseBlend = 0.12;
// A wall overhead pushes the bucket down like a load, along which it also slides, but does not let it rise: bucket and
// wall give way, and the bucket turns, by up to 2 cm of the load's usual place (docs/theory.md).
constexpr double kLifted_m = 0.03;
// The bucket is called empty when a load beyond this is out of the question.
constexpr double kEmpty_kg = 3;
// A force against the load's weight for so long makes the load itself doubtful: it may have fallen out.
constexpr double kDoubt_s = 0.1;
// A load that updates agree upon for so long is carried; its weight passes from force to load and back in these times.
constexpr double kKnownAfterUpdates = 4, kTakeUp_s = 0.3, kLetGo_s = 0.1;

}  // namespace

PayloadEstimator::PayloadEstimator(const MachineDescription& machine, double step_s)
    : acceleration_(kSlowBand.observer_Hz, step_s, JointVector::Zero()),
      length_m_(machine.links[0].length_m, machine.links[1].length_m, machine.links[2].length_m),
      usual_place_m_(machine.payload_com_m),
      full_scale_kg_(machine.payload_full_scale_kg > 0 ? machine.payload_full_scale_kg : machine.links[2].mass_kg),
      step_s_(step_s) {
  start();
}

void PayloadEstimator::start() noexcept {
  information_.setZero();
  right_.setZero();
  unknowns_.setZero();
  covariance_.setZero();
  covariance_(0, 0) = 4 * full_scale_kg_ * full_scale_kg_;
  surprise_.setZero();
  squares_ = updates_ = since_update_s_ = 0;
  forget_way();
  kg_ = zero_kg_;
  sigma_kg_ = own_sigma_kg_ = weighed_sigma_kg_ = 2 * full_scale_kg_;
}

bool PayloadEstimator::zero() noexcept {
  maybe_loaded_ = false;
  if (updates_ <= kKnownAfterUpdates) return false;
  // What is called empty below a wall, or on ground, may be its push, and may have been so the time before.
  const double doubted_before_kg = not_lifted() > 0 ? zero_sigma_kg_ : 0;
  zero_sigma_kg_ = std::hypot(own_sigma_kg_, not_lifted() * kg(), doubted_before_kg);
  zero_kg_ = kg_;
  start();
  return true;
}

void PayloadEstimator::restart_motion() noexcept {
  forget_way();
  forget_acceleration();
}

void PayloadEstimator::forget_acceleration() noexcept {
  rate_known_ = false;
  acceleration_.reset(JointVector::Zero());
  inertia_Nm_per_kg_.setZero();
}

void PayloadEstimator::forget_way() noexcept {
  lowest_m_ = 0;
  highest_m_ = -1;
}

double PayloadEstimator::not_lifted() const noexcept {
  return std::clamp(1 - (highest_m_ - lowest_m_) / kLifted_m, 0.0, 1.0);
}

void PayloadEstimator::step(const JointState& state, const ForceEstimate& force) noexcept {
  const bool followed = follow_motion(state, force);
  judge_load(force);
  carry();
  since_update_s_ += step_s_;
  if (!followed || since_update_s_ < kUpdateEvery_s) return;
  const JointVector torque = force.joint_torque_Nm + force.carried_Nm;
  if (!torque.allFinite()) return;
  const double fastest = force.rod_mps.cwiseAbs().maxCoeff();
  if (fastest < kSlowest_mps || fastest > kFastest_mps) return;
  since_update_s_ = 0;
  const JointVector least = kLeastResidual_N * force.lever_m.cwiseAbs().cwiseMax(kLeastSureLever_m);
  const JointVector variance = force.measurement_variance_Nm2.cwiseMax(least.cwiseAbs2());
  const Rows update = rows(state, force);
  if (surprised(update, torque, variance)) start();
  accumulate(update, torque, variance);
  solve(force);
}

bool PayloadEstimator::follow_motion(const JointState& state, const ForceEstimate& force) noexcept {
  if (!state.angle_rad.allFinite()) {
    restart_motion();
    return false;
  }
  if ((force.lever_m.array().abs() < kLeastLever_m).any()) {
    forget_acceleration();
    return false;
  }
  const JointVector rate = force.rod_mps.cwiseQuotient(force.lever_m);
  acceleration_.step((rate - (rate_known_ ? last_rate_radps_ : rate)) / step_s_);
  last_rate_radps_ = rate;
  rate_known_ = true;
  const Pose pose(state.angle_rad, state.hull_pitch_rad);
  const auto turned_left = [](const PlanarVector& v) { return PlanarVector(-v.y(), v.x()); };
  // Way of the load per turn of each joint.
  std::array<PlanarVector, kJoints> way;
  PlanarVector reach(pose.cos[kBucket] * usual_place_m_.x() - pose.sin[kBucket] * usual_place_m_.y(),
                     pose.sin[kBucket] * usual_place_m_.x() + pose.cos[kBucket] * usual_place_m_.y());
  const JointVector turning = absolute(rate);
  PlanarVector acceleration_mps2 = -turning[kBucket] * turning[kBucket] * reach;
  for (int i = kBucket; i >= 0; --i) {
    if (i < kBucket) {
      const PlanarVector link = length_m_[i] * PlanarVector(pose.cos[i], pose.sin[i]);
      reach += link;
      acceleration_mps2 -= turning[i] * turning[i] * link;
    }
    way[static_cast<std::size_t>(i)] = turned_left(reach);
    acceleration_mps2 += acceleration_.value()[i] * way[static_cast<std::size_t>(i)];
  }
  height_m_ = reach.y();
  for (int i = 0; i < kJoints; ++i) inertia_Nm_per_kg_[i] = -way[static_cast<std::size_t>(i)].dot(acceleration_mps2);
  return true;
}

PayloadEstimator::Rows PayloadEstimator::rows(const JointState& state, const ForceEstimate& force) const noexcept {
  const Eigen::Matrix3d load = load_columns(length_m_, Pose(state.angle_rad, state.hull_pitch_rad));
  Rows rows = Rows::Zero();
  rows.leftCols<3>() = load;
  rows.col(0) += load.rightCols<2>() * usual_place_m_ + inertia_Nm_per_kg_;
  rows.middleCols<3>(3).diagonal() = force.lever_m;
  rows.rightCols<3>().diagonal() = force.turned_lever_m;
  return rows;
}

bool PayloadEstimator::surprised(const Rows& rows, const JointVector& torque_Nm, const JointVector& variance) noexcept {
  for (int i = 0; i < kJoints; ++i) {
    const double innovation = torque_Nm[i] - rows.row(i) * unknowns_;
    const double expected = variance[i] + rows.row(i) * covariance_ * rows.row(i).transpose();
    surprise_[i] += kSurpriseBlend * (innovation / std::sqrt(expected) - surprise_[i]);
  }
  return surprise_.cwiseAbs().maxCoeff() > kSurprise;
}

void PayloadEstimator::accumulate(const Rows& rows, const JointVector& torque_Nm,
                                  const JointVector& variance) noexcept {
  const double fade = std::exp(-kUpdateEvery_s / kMemory_s);
  information_ *= fade;
  right_ *= fade;
  squares_ *= fade;
  updates_ = updates_ * fade + 1;
  const bool first = lowest_m_ > highest_m_;
  lowest_m_ = first ? height_m_ : std::min(lowest_m_, height_m_);
  highest_m_ = first ? height_m_ : std::max(highest_m_, height_m_);
  const JointVector weight = variance.cwiseInverse();
  information_ += rows.transpose() * weight.asDiagonal() * rows;
  right_ += rows.transpose() * weight.cwiseProduct(torque_Nm);
  squares_ += weight.dot(torque_Nm.cwiseAbs2());
}

void PayloadEstimator::solve(const ForceEstimate& force) noexcept {
  // Neighbouring updates repeat each other, so each counts for a part only; the priors count in full.
  Unknowns prior;
  const double moment = kPlace_m * std::max(std::abs(kg_ - zero_kg_), kLeastLoad_kg);
  const JointVector lever = force.lever_m.cwiseAbs().cwiseMax(kLeastSureLever_m);
  const JointVector from_bias_N2 = force.bias_variance_Nm2.cwiseQuotient(lever.cwiseAbs2());
  prior << 4 * full_scale_kg_ * full_scale_kg_, moment * moment, moment * moment,
      from_bias_N2.array() + kConstant_N * kConstant_N, JointVector::Constant(kDirection_N * kDirection_N);
  Information full = information_ / kUpdatesPerIndependent;
  full.diagonal() += prior.cwiseInverse();
  const Eigen::LDLT<Information> factors(full);
  unknowns_ = factors.solve(right_ / kUpdatesPerIndependent);
  const double left = squares_ - 2 * unknowns_.dot(right_) + unknowns_.dot(information_ * unknowns_);
  const auto known = static_cast<double>(force.measurement_variance_Nm2.array().isFinite().count());
  const double misfit = std::max(1.0, left / (known * std::max(updates_, 1.0)));
  covariance_ = factors.solve(Information::Identity());
  kg_ = unknowns_[0];
  own_sigma_kg_ = std::sqrt(misfit * covariance_(0, 0));
  // No bucket weighs less than nothing: what is below is what the fit has got wrong.
  weighed_sigma_kg_ = std::hypot(own_sigma_kg_, zero_sigma_kg_, std::min(0.0, kg()));
  sigma_kg_ = std::hypot(weighed_sigma_kg_, not_lifted() * std::max(0.0, kg()));
}

/// Who touches something may have taken some of it along or lost it.
void PayloadEstimator::judge_load(const ForceEstimate& force) noexcept {
  const bool bias_learned = (force.confidence_reasons & kBiasNotLearned) == 0;
  if (bias_learned && !bias_learned_) start();
  bias_learned_ = bias_learned;
  // What the carried load's inertia explains is no doubt.
  JointVector left = force.joint_torque_Nm - carried_[0] * inertia_Nm_per_kg_;
  left = force.measurement_variance_Nm2.array().isFinite().select(left, JointVector::Zero());
  const bool lifts = force.significant && left.dot(force.carried_Nm) < 0 &&
                     left.squaredNorm() > 0.5 * force.joint_torque_Nm.squaredNorm();
  doubted_s_ = lifts && known() ? doubted_s_ + step_s_ : 0;
  if (doubted_s_ > kDoubt_s) start();
  const bool seen = kg() > kEmpty_kg + 3 * weighed_sigma_kg_;  // lifted or not
  // A bucket that was lifted and weighs less than its zero is taken for empty, too: whatever is wrong there, the bias
  // filter has to follow it.
  const double doubt_kg = std::hypot(own_sigma_kg_, zero_sigma_kg_, not_lifted() * kg());
  const bool empty = !force.contact && kg() < kEmpty_kg && doubt_kg < kEmpty_kg;
  if (force.contact || seen) maybe_loaded_ = true;
  if (empty || !bias_learned_) maybe_loaded_ = false;
}

bool PayloadEstimator::known() const noexcept {
  return bias_learned_ && updates_ > kKnownAfterUpdates && kg() > 3 * sigma_kg_;
}

void PayloadEstimator::carry() noexcept {
  Load load = Load::Zero();
  if (known()) {
    load[0] = kg();
    load.tail<2>() = kg() * usual_place_m_ + unknowns_.segment<2>(1);
  }
  carried_ += (1 - std::exp(-step_s_ / (known() ? kTakeUp_s : kLetGo_s))) * (load - carried_);
}

}  // namespace knuckle::estimation
