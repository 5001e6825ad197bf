// Stiffness along the digging motion.
#include "estimation/buried_object.h"

#include <algorithm>
#include <cmath>

#include "estimation/tip_force.h"

namespace knuckle::estimation {
namespace {

constexpr double kTurned = 0.5;             // cosine: a direction that differs by more than 60 deg is another one
constexpr double kDirectionMemory_s = 0.2;  // of the digging's direction
constexpr double kSlowed = 0.5;             // of the speed so far

}  // namespace

BuriedObjectCue::BuriedObjectCue(const MachineDescription& machine, double step_s)
    : kinematics_(machine),
      step_s_(step_s),
      window_(std::clamp(static_cast<int>(std::lround(kWindow_s / step_s)), 1, kSamples - 1)),
      first_(kFastBand.velocity_Hz, step_s),
      second_(kFastBand.velocity_Hz, step_s),
      third_(kFastBand.observer_Hz, step_s) {}

bool BuriedObjectCue::step(const JointState& state, const ForceEstimate& force) noexcept {
  if (!state.angle_rad.allFinite() || !force.fast_torque_Nm.allFinite()) return on_;
  const PlanarVector tip = kinematics_.tip(state.angle_rad);
  if (!started_) {
    first_.reset(tip);
    second_.reset(tip);
    third_.reset(tip);
    past_.fill({tip, PlanarVector::Zero()});
    direction_.setZero();
    path_m_ = fastest_mps_ = 0;
    started_ = true;
    on_ = false;
  }
  const PlanarVector before = third_.value();
  const JointVector variance = force.measurement_variance_Nm2 + force.bias_variance_Nm2;
  const TipForce solved =
      solve_tip_force(kinematics_.tip_jacobian(state.angle_rad), force.fast_torque_Nm, variance.asDiagonal());
  const Sample now{third_.step(second_.step(first_.step(tip))), solved.force_N};
  const PlanarVector speed = (now.tip_m - before) / step_s_;
  const double against_N = -direction_.dot(now.force_N);
  const double sigma_N = std::sqrt(std::max(0.0, direction_.dot(solved.covariance_N2 * direction_)));
  if (on_) {
    held_N_ = std::max(held_N_, against_N);
    if (against_N < kLetGo * held_N_) started_ = on_ = false;  // whatever comes next is another story
    return on_;
  }
  on_ = met(now, direction_.dot(speed), sigma_N);
  if (on_) held_N_ = against_N;
  follow(speed, against_N);
  past_[static_cast<std::size_t>(oldest_)] = now;
  oldest_ = (oldest_ + 1) % kSamples;
  return on_;
}

/// Direction, path and what is usual in this digging so far.
void BuriedObjectCue::follow(const PlanarVector& tip_mps, double against_N) noexcept {
  const double speed = tip_mps.norm();
  const double fade = std::exp(-step_s_ / kMemory_s);
  if (speed > kSlowest_mps) {
    const bool turned = direction_.dot(tip_mps) < kTurned * speed;
    if (turned) path_m_ = fastest_mps_ = 0;
    direction_ = turned ? PlanarVector(tip_mps / speed)
                        : PlanarVector(direction_ + step_s_ / kDirectionMemory_s * (tip_mps / speed - direction_));
    direction_.normalize();
    path_m_ = against_N > kDigging_N ? path_m_ + speed * step_s_ : path_m_ * fade;
  }
  fastest_mps_ = std::max(direction_.dot(tip_mps), fastest_mps_ * fade);
}

bool BuriedObjectCue::met(const Sample& now, double speed_mps, double sigma_N) noexcept {
  if (path_m_ < kDugPath_m || speed_mps > kSlowed * fastest_mps_) return false;
  double before_N = 0;
  for (int age = window_; age <= kSamples; ++age) before_N = std::max(before_N, -direction_.dot(sample(age).force_N));
  const double rise = -direction_.dot(now.force_N) - before_N;
  const double way = std::max(0.0, direction_.dot(now.tip_m - sample(window_).tip_m)) + kResolution_m;
  if (rise < kRise_N + kRiseSigmas * sigma_N || rise < kStiffness_N_per_m * way) return false;
  stiffness_N_per_m_ = rise / way;
  return true;
}

}  // namespace knuckle::estimation
