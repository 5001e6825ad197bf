// Normal equations of the payload's fit, with fading memory and priors.
#include "estimation/payload.h"

#include <algorithm>
#include <cmath>

#include "estimation/regressor.h"

namespace knuckle::estimation {
namespace {

constexpr double kSlowest_mps = 5e-3, kFastest_mps = 0.1;  // of the rods: moving, but slowly
constexpr double kConstant_N = 30, kFriction_N = 50;       // what the tare leaves, per cylinder
constexpr double kReach_m = 0.5;                           // a load lies within so much of the bucket pin
constexpr double kLook_N = 120;                            // residual of one look, cylinder equivalent
constexpr double kSmallestLever_m = 0.05;
constexpr double kLooksPerIndependent = 40;  // looks of two seconds tell about the same

}  // namespace

PayloadEstimator::PayloadEstimator(const MachineDescription& machine, double step_s)
    : length_m_(machine.links[0].length_m, machine.links[1].length_m, machine.links[2].length_m),
      full_scale_kg_(machine.payload_full_scale_kg > 0 ? machine.payload_full_scale_kg : machine.links[2].mass_kg),
      step_s_(step_s) {
  Unknowns sigma;
  const double moment = full_scale_kg_ * kReach_m;
  sigma << 2 * full_scale_kg_, moment, moment, JointVector::Constant(kConstant_N), JointVector::Constant(kFriction_N);
  prior_information_ = sigma.array().square().inverse();
  start();
}

void PayloadEstimator::start() noexcept {
  information_.setZero();
  right_.setZero();
  squares_ = looks_ = since_look_s_ = 0;
  kg_ = zero_kg_;
  sigma_kg_ = own_sigma_kg_ = 2 * full_scale_kg_;
}

void PayloadEstimator::zero() noexcept {
  zero_kg_ = kg_;
  zero_sigma_kg_ = own_sigma_kg_;
  start();
}

void PayloadEstimator::step(const JointState& state, const ForceEstimate& force) noexcept {
  since_look_s_ += step_s_;
  if (since_look_s_ < kLookEvery_s) return;
  if (!state.angle_rad.allFinite() || !force.joint_torque_Nm.allFinite()) return;
  const double fastest = state.cylinder_mps.cwiseAbs().maxCoeff();
  if (fastest < kSlowest_mps || fastest > kFastest_mps) return;
  since_look_s_ = 0;
  accumulate(state, force.joint_torque_Nm);
  solve();
}

void PayloadEstimator::accumulate(const JointState& state, const JointVector& torque_Nm) noexcept {
  const Pose pose(state.angle_rad, state.hull_pitch_rad);
  const double fade = std::exp(-kLookEvery_s / kMemory_s);
  information_ *= fade;
  right_ *= fade;
  squares_ *= fade;
  looks_ = looks_ * fade + 1;
  Unknowns row = Unknowns::Zero();
  row[1] = -kGravity_mps2 * pose.cos[kBucket];
  row[2] = kGravity_mps2 * pose.sin[kBucket];
  for (int i = kBucket; i >= 0; --i) {
    if (i < kBucket) row[0] -= kGravity_mps2 * length_m_[i] * pose.cos[i];
    row.tail<2 * kJoints>().setZero();
    row[3 + i] = state.lever_m[i];
    row[6 + i] = state.lever_m[i] * std::tanh(state.cylinder_mps[i] / kSlowest_mps);
    const double weight = std::pow(kLook_N * std::max(std::abs(state.lever_m[i]), kSmallestLever_m), -2);
    information_ += weight * row * row.transpose();
    right_ += weight * torque_Nm[i] * row;
    squares_ += weight * torque_Nm[i] * torque_Nm[i];
  }
}

void PayloadEstimator::solve() noexcept {
  // Neighbouring looks repeat each other, so each counts for a part only; the priors count in full.
  Information full = information_ / kLooksPerIndependent;
  full.diagonal() += prior_information_;
  const Eigen::LDLT<Information> factors(full);
  const Unknowns x = factors.solve(right_ / kLooksPerIndependent);
  const Unknowns column = factors.solve(Unknowns::Unit(0));
  const double left = squares_ - 2 * x.dot(right_) + x.dot(information_ * x);
  const double misfit = std::max(1.0, left / (kJoints * std::max(looks_, 1.0)));
  kg_ = x[0];
  own_sigma_kg_ = std::sqrt(column[0] * misfit);
  sigma_kg_ = std::hypot(own_sigma_kg_, zero_sigma_kg_);
}

}  // namespace knuckle::estimation
