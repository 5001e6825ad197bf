// Rigid-body dynamics of the planar three-link arm, linear in nine base parameters, with and without acceleration.
// Force estimation and identification share it. Equations: docs/theory.md ("Model").
//
// Coordinates. The regressors are in *absolute* link angles phi_1 = theta_boom + hull pitch, phi_2 = phi_1 + theta_arm,
// phi_3 = phi_2 + theta_bucket, with generalised forces Q_i = tau_i - tau_{i+1}. Everything that leaves this file as
// a joint torque is in *relative* joints, tau_i = sum of Q_k over k >= i: there a cylinder acts on its own joint alone,
// tau_i = lever_i * F_i, and friction needs no coupling between rows.
#pragma once

#include "core/joints.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

inline constexpr double kGravity_mps2 = 9.81;
inline constexpr int kBaseParameters = 9;
inline constexpr int kInertia = 0;  ///< J_i at kInertia + i, kg m^2
inline constexpr int kMomentX = 3;  ///< X_i at kMomentX + i, kg m
inline constexpr int kMomentZ = 6;  ///< Z_i at kMomentZ + i, kg m

using BaseParameters = Eigen::Matrix<double, kBaseParameters, 1>;
using Regressor = Eigen::Matrix<double, kJoints, kBaseParameters>;

/// J_i = I_i + m_i |c_i|^2 + l_i^2 sum m_k, X_i = m_i x_i + l_i sum m_k, Z_i = m_i z_i, sums over the later links k >
/// i. Links only: cylinder and linkage masses have no exact place in them (lumped_parameters approximates).
[[nodiscard]] BaseParameters base_parameters(const MachineDescription& machine);
/// base_parameters plus cylinders and bucket linkage as point masses at their pins, by where their weight hangs in the
/// middle of the stroke. What moves with the stroke, and the weight along a cylinder, is left to the bias filter.
[[nodiscard]] BaseParameters lumped_parameters(const MachineDescription& machine);
/// Mass of each link in lumped_parameters, what hangs on it included: base parameters do not tell it.
[[nodiscard]] JointVector lumped_masses_kg(const MachineDescription& machine);
/// What is known of this machine: as identified, or lumped_parameters where it was not.
[[nodiscard]] BaseParameters known_parameters(const MachineDescription& machine);

/// Absolute link angles with their sines and cosines: what every regressor at one pose shares.
struct Pose {
  Pose(const JointVector& joints_rad, double hull_pitch_rad) noexcept;
  JointVector cos, sin;
};

/// theta (or its rate) of relative joints to absolute links: running sum.
[[nodiscard]] inline JointVector absolute(const JointVector& relative) noexcept {
  return {relative[0], relative[0] + relative[1], relative[0] + relative[1] + relative[2]};
}
/// Generalised forces of absolute angles to relative-joint torques: the transposed running sum.
[[nodiscard]] inline JointVector joint_torque(const JointVector& absolute_forces) noexcept {
  const auto& q = absolute_forces;
  return {q[0] + q[1] + q[2], q[1] + q[2], q[2]};
}

class RigidArm {
 public:
  explicit RigidArm(const MachineDescription& machine);

  /// Q = Y phi for given rates and accelerations of the absolute angles.
  [[nodiscard]] Regressor inverse_dynamics(const Pose& pose, const JointVector& rate,
                                           const JointVector& acceleration) const noexcept;
  /// Acceleration-free form Q = d/dt(Y_p phi) + Y_v phi. Y_p phi is the generalised momentum.
  [[nodiscard]] Regressor momentum(const Pose& pose, const JointVector& rate) const noexcept;
  /// Velocity-product columns of Y_v.
  [[nodiscard]] Regressor velocity_products(const Pose& pose, const JointVector& rate) const noexcept;
  /// Gravity columns of Y_v: g cos phi_i on X_i and -g sin phi_i on Z_i.
  [[nodiscard]] static Regressor gravity(const Pose& pose) noexcept;

  /// Mass matrix of the relative joints: their momentum is that times their rates.
  [[nodiscard]] Eigen::Matrix3d inertia(const Pose& pose, const BaseParameters& parameters) const noexcept;

  [[nodiscard]] const JointVector& length_m() const noexcept { return length_m_; }

 private:
  JointVector length_m_;
};

/// Relative-joint torques [N m] of motion (relative joints, hull at rest) under gravity, cylinders and friction apart.
[[nodiscard]] JointVector inverse_dynamics(const RigidArm& arm, const BaseParameters& parameters,
                                           const JointVector& joints_rad, const JointVector& rate_radps,
                                           const JointVector& acceleration_radps2, double hull_pitch_rad) noexcept;

}  // namespace knuckle::estimation
