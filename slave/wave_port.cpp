#include "slave/wave_port.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "slave/set_point_check.h"

namespace knuckle::slave {
namespace {

constexpr double kSingularity = 1e-3;  // of J W J^T, about 0.5 in both directions where the arm is well bent
constexpr double kDrift_1ps = 0.5;
// Waves lead no further away from what was asked than a set-point may be wrong by (set_point_check.h): the check judges
// what the operator's side sends, and this moves the machine beyond it.
constexpr double kLeeway_rad = kSetPointTable.disagreement_rad;

}  // namespace

WavePort::WavePort(const MachineDescription& machine, double step_s)
    : kinematics_(machine),
      weight_(machine.control.stiffness_radius_m.cwiseAbs2().cwiseInverse()),
      most_mps_(machine.limits.tip_speed_mps),
      step_s_(step_s) {
  for (int i = 0; i < kJoints; ++i) {
    low_rad_[i] = machine.links[static_cast<std::size_t>(i)].min_rad;
    high_rad_[i] = machine.links[static_cast<std::size_t>(i)].max_rad;
  }
}

WavePort::Reference WavePort::step(const Reference& asked, const MasterMessage& message,
                                   const JointVector& measured_rad, const PlanarVector& world_N, bool led,
                                   Time now) noexcept {
  const double b = message.wave_Ns_per_m;
  if (!led || !(b > 0)) {
    arriving_.skip();
    running_ = false;
    kept_J_ = 0;
    return asked;
  }
  if (!running_) reference_rad_ = asked.position_rad;
  running_ = true;
  arriving_.take(message.stamp.sent_at, message.wave, now);
  const PlanarVector wave = arriving_.step(now, step_s_), pushes_N = -world_N;
  PlanarVector speed_mps = (std::sqrt(2 * b) * wave - pushes_N) / b;
  if (speed_mps.norm() > most_mps_) speed_mps *= most_mps_ / speed_mps.norm();

  const Eigen::Matrix<double, 2, 3> jacobian = kinematics_.tip_jacobian(measured_rad);
  const Eigen::Matrix<double, 3, 2> weighted = weight_.asDiagonal() * jacobian.transpose();
  const Eigen::Matrix2d normal = jacobian * weighted + kSingularity * Eigen::Matrix2d::Identity();
  const PlanarVector beside_mps = speed_mps - jacobian * asked.velocity_radps;
  JointVector rate_radps = asked.velocity_radps + weighted * (normal.inverse() * beside_mps);
  const JointVector drift_radps = kDrift_1ps * (asked.position_rad - reference_rad_);
  const double pushed_J = std::max(0.0, step_s_ * pushes_N.dot(speed_mps));
  const double drift_J = std::max(0.0, step_s_ * pushes_N.dot(jacobian * drift_radps));
  const bool paid = arriving_.pay(drift_J);
  if (paid) rate_radps += drift_radps;
  const JointVector before_rad = reference_rad_;
  const JointVector leeway = JointVector::Constant(kLeeway_rad);
  // These bounds only stop: what lies beyond them already stays where it is, as moving it could be work on the world.
  const JointVector low_rad = (asked.position_rad - leeway).cwiseMax(low_rad_).cwiseMin(before_rad);
  const JointVector high_rad = (asked.position_rad + leeway).cwiseMin(high_rad_).cwiseMax(before_rad);
  reference_rad_ = (before_rad + step_s_ * rate_radps).cwiseMax(low_rad).cwiseMin(high_rad);
  // A joint that stops and one that goes on turn the tip's motion, and so does the singularity: no push on the world
  // comes of it beyond those of the wave and of what was paid.
  const double work_J = pushes_N.dot(jacobian * (reference_rad_ - before_rad));
  const double most_J = pushed_J + (paid ? drift_J : 0);
  if (work_J > most_J) reference_rad_ = before_rad + most_J / work_J * (reference_rad_ - before_rad);
  rate_radps = (reference_rad_ - before_rad) / step_s_;

  // The wave that returns is that of the speed it became, with no more energy than is left of the one that arrived.
  speed_mps = jacobian * rate_radps;
  kept_J_ += step_s_ * (0.5 * wave.squaredNorm() - pushes_N.dot(speed_mps)) + (paid ? drift_J : 0);
  PlanarVector back = (b * speed_mps - pushes_N) / std::sqrt(2 * b);
  const double cost_J = 0.5 * step_s_ * back.squaredNorm(), left_J = std::max(0.0, kept_J_);
  if (cost_J > left_J) back *= std::sqrt(left_J / cost_J);
  kept_J_ -= std::min(cost_J, left_J);
  returning_.add(back, step_s_);
  return {reference_rad_, rate_radps};
}

}  // namespace knuckle::slave
