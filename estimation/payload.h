// Weighs what the bucket holds while it moves through free air: joint least squares on the external torques for mass
// and first moments of the load, both directions of motion, with a standard deviation. Step is real-time.
#pragma once

#include <Eigen/Dense>

#include "core/joints.h"
#include "estimation/force_estimator.h"
#include "estimation/joint_state.h"
#include "machine/description.h"

namespace knuckle::estimation {

/// A load m at (x, z) of the bucket's axes loads the joints with
///   tau_bucket = -g (m x cos phi_3 - m z sin phi_3),  tau_arm = tau_bucket - g m l_arm cos phi_2,
///   tau_boom = tau_arm - g m l_boom cos phi_1,
/// so the boom-minus-arm and arm-minus-bucket rows know nothing of where the load lies. Unknown beside (m, m x, m z):
/// per cylinder a constant and a part with the sign of motion (friction that the tare has not got right), with priors;
/// moving both ways separates the second from the load.
///
/// Only motion counts (at rest friction hides the load), and only slow motion (the load's inertia is not modelled).
/// Looks fade with kMemory_s. A contact is not gravity-like: it spoils the fit over poses, and the left-over widens
/// sigma; so the caller may take the kg() of the moment when sigma_kg() was least since start().
class PayloadEstimator {
 public:
  static constexpr double kMemory_s = 8;
  static constexpr double kLookEvery_s = 0.05;

  PayloadEstimator(const MachineDescription& machine, double step_s);

  /// A new lift: forgets the looks so far, keeps the zero.
  void start() noexcept;
  /// The bucket is empty now: what the present lift says becomes zero for the next ones, and a new lift starts.
  void zero() noexcept;
  void step(const JointState& state, const ForceEstimate& force) noexcept;

  [[nodiscard]] double kg() const noexcept { return kg_ - zero_kg_; }
  [[nodiscard]] double sigma_kg() const noexcept { return sigma_kg_; }

 private:
  static constexpr int kUnknowns = 9;  ///< m, m x, m z, constant[3], friction[3]
  using Information = Eigen::Matrix<double, kUnknowns, kUnknowns>;
  using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;

  void accumulate(const JointState& state, const JointVector& torque_Nm) noexcept;
  void solve() noexcept;

  JointVector length_m_;
  double full_scale_kg_, step_s_;
  Unknowns prior_information_;
  Information information_ = Information::Zero();
  Unknowns right_ = Unknowns::Zero();
  double squares_ = 0, looks_ = 0;
  double since_look_s_ = 0;
  double kg_ = 0, sigma_kg_ = 0, own_sigma_kg_ = 0, zero_kg_ = 0, zero_sigma_kg_ = 0;
};

}  // namespace knuckle::estimation
