// Rigid-body regressors of the planar arm, column by column.
#include "estimation/regressor.h"

#include <array>
#include <cmath>

#include "machine/description.h"

namespace knuckle::estimation {
namespace {

/// Adds a point mass on link `link` at `at_m` of its axes, seen by that link and by every earlier one.
void add_point_mass(BaseParameters& parameters, const MachineDescription& machine, int link, const PlanarVector& at_m,
                    double mass_kg) {
  parameters[kInertia + link] += mass_kg * at_m.squaredNorm();
  parameters[kMomentX + link] += mass_kg * at_m.x();
  parameters[kMomentZ + link] += mass_kg * at_m.y();
  for (int i = 0; i < link; ++i) {
    const double length = machine.links[static_cast<std::size_t>(i)].length_m;
    parameters[kInertia + i] += mass_kg * length * length;
    parameters[kMomentX + i] += mass_kg * length;
  }
}

/// What a cylinder's two pins carry of its weight, in the middle of its stroke: body and rod are taken as uniform, each
/// as long as the closed cylinder.
struct PinShares {
  explicit PinShares(const CylinderDescription& cylinder) {
    const double far = cylinder.min_length_m / (cylinder.min_length_m + cylinder.max_length_m);
    parent_kg = (1 - far) * cylinder.body_mass_kg + far * cylinder.rod_mass_kg;
    child_kg = far * cylinder.body_mass_kg + (1 - far) * cylinder.rod_mass_kg;
  }
  double parent_kg, child_kg;
};

struct PointMass {
  int link;
  PlanarVector at_m;  ///< Link axes.
  double mass_kg;
};

/// Cylinders and bucket linkage, by where their weight hangs.
std::array<PointMass, 6> hung_masses(const MachineDescription& machine) {
  const auto& [boom, arm, bucket] = machine.cylinders;
  const BucketLinkage& linkage = machine.bucket_linkage;
  const PinShares boom_shares(boom), arm_shares(arm), bucket_shares(bucket);
  // H moves on the arm; half-way between the pins J and K that hold it is near enough.
  const double at_h = bucket_shares.child_kg + (linkage.rocker_mass_kg + linkage.coupler_mass_kg) / 2;
  return {{{kBoom, machine.boom_mount.child_pin_m, boom_shares.child_kg},
           {kBoom, machine.arm_mount.parent_pin_m, arm_shares.parent_kg},
           {kArm, machine.arm_mount.child_pin_m, arm_shares.child_kg},
           {kArm, linkage.cylinder_pin_m, bucket_shares.parent_kg},
           {kArm, linkage.rocker_pin_m, (at_h + linkage.rocker_mass_kg) / 2},
           {kBucket, linkage.bucket_pin_m, (at_h + linkage.coupler_mass_kg) / 2}}};
}

}  // namespace

BaseParameters base_parameters(const MachineDescription& machine) {
  BaseParameters parameters = BaseParameters::Zero();
  for (int i = 0; i < kJoints; ++i) {
    const LinkDescription& link = machine.links[static_cast<std::size_t>(i)];
    parameters[kInertia + i] += link.inertia_kgm2;
    add_point_mass(parameters, machine, i, link.com_m, link.mass_kg);
  }
  return parameters;
}

BaseParameters lumped_parameters(const MachineDescription& machine) {
  BaseParameters parameters = base_parameters(machine);
  for (const PointMass& mass : hung_masses(machine)) {
    add_point_mass(parameters, machine, mass.link, mass.at_m, mass.mass_kg);
  }
  return parameters;
}

JointVector lumped_masses_kg(const MachineDescription& machine) {
  JointVector masses;
  for (int i = 0; i < kJoints; ++i) masses[i] = machine.links[static_cast<std::size_t>(i)].mass_kg;
  for (const PointMass& mass : hung_masses(machine)) masses[mass.link] += mass.mass_kg;
  return masses;
}

BaseParameters known_parameters(const MachineDescription& machine) {
  return machine.dynamics_calibration ? machine.dynamics_calibration->base() : lumped_parameters(machine);
}

Pose::Pose(const JointVector& joints_rad, double hull_pitch_rad) noexcept {
  const JointVector phi = absolute(joints_rad).array() + hull_pitch_rad;
  cos = phi.array().cos();
  sin = phi.array().sin();
}

RigidArm::RigidArm(const MachineDescription& machine)
    : length_m_(machine.links[0].length_m, machine.links[1].length_m, machine.links[2].length_m) {}

Regressor RigidArm::gravity(const Pose& pose) noexcept {
  Regressor y = Regressor::Zero();
  for (int i = 0; i < kJoints; ++i) {
    y(i, kMomentX + i) = kGravity_mps2 * pose.cos[i];
    y(i, kMomentZ + i) = -kGravity_mps2 * pose.sin[i];
  }
  return y;
}

Regressor RigidArm::inverse_dynamics(const Pose& pose, const JointVector& rate,
                                     const JointVector& acceleration) const noexcept {
  Regressor y = gravity(pose);
  for (int i = 0; i < kJoints; ++i) {
    y(i, kInertia + i) = acceleration[i];
    for (int k = i + 1; k < kJoints; ++k) {
      const double c = length_m_[i] * (pose.cos[k] * pose.cos[i] + pose.sin[k] * pose.sin[i]);
      const double s = length_m_[i] * (pose.sin[k] * pose.cos[i] - pose.cos[k] * pose.sin[i]);
      y(i, kMomentX + k) = c * acceleration[k] - s * rate[k] * rate[k];
      y(i, kMomentZ + k) = -s * acceleration[k] - c * rate[k] * rate[k];
      y(k, kMomentX + k) += c * acceleration[i] + s * rate[i] * rate[i];
      y(k, kMomentZ + k) += -s * acceleration[i] + c * rate[i] * rate[i];
    }
  }
  return y;
}

Regressor RigidArm::momentum(const Pose& pose, const JointVector& rate) const noexcept {
  Regressor y = Regressor::Zero();
  for (int i = 0; i < kJoints; ++i) {
    y(i, kInertia + i) = rate[i];
    for (int k = i + 1; k < kJoints; ++k) {
      const double c = length_m_[i] * (pose.cos[k] * pose.cos[i] + pose.sin[k] * pose.sin[i]);
      const double s = length_m_[i] * (pose.sin[k] * pose.cos[i] - pose.cos[k] * pose.sin[i]);
      y(i, kMomentX + k) = c * rate[k];
      y(i, kMomentZ + k) = -s * rate[k];
      y(k, kMomentX + k) += c * rate[i];
      y(k, kMomentZ + k) -= s * rate[i];
    }
  }
  return y;
}

Regressor RigidArm::velocity_products(const Pose& pose, const JointVector& rate) const noexcept {
  Regressor y = Regressor::Zero();
  for (int i = 0; i < kJoints; ++i) {
    for (int k = i + 1; k < kJoints; ++k) {
      const double c = length_m_[i] * (pose.cos[k] * pose.cos[i] + pose.sin[k] * pose.sin[i]);
      const double s = length_m_[i] * (pose.sin[k] * pose.cos[i] - pose.cos[k] * pose.sin[i]);
      const double product = rate[i] * rate[k];
      y(i, kMomentX + k) = -s * product;
      y(i, kMomentZ + k) = -c * product;
      y(k, kMomentX + k) += s * product;
      y(k, kMomentZ + k) += c * product;
    }
  }
  return y;
}

Eigen::Matrix3d RigidArm::inertia(const Pose& pose, const BaseParameters& parameters) const noexcept {
  Eigen::Matrix3d inertia;
  for (int i = 0; i < kJoints; ++i)
    inertia.col(i) = joint_torque(momentum(pose, absolute(JointVector::Unit(i))) * parameters);
  return inertia;
}

JointVector inverse_dynamics(const RigidArm& arm, const BaseParameters& parameters, const JointVector& joints_rad,
                             const JointVector& rate_radps, const JointVector& acceleration_radps2,
                             double hull_pitch_rad) noexcept {
  const Pose pose(joints_rad, hull_pitch_rad);
  return joint_torque(arm.inverse_dynamics(pose, absolute(rate_radps), absolute(acceleration_radps2)) * parameters);
}

}  // namespace knuckle::estimation
