#include "slave/contact_law.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/trust.h"
#include "machine/oil_stiffness.h"

namespace knuckle::slave {
namespace {

constexpr double kSingularity = 0.02;  // of J W J^T (about 0.5 in both directions where the arm is well bent)
constexpr double kLargestPress = 10;   // of F1: force complied with, no press needs more
// Of F1: from where on a force is one, says where it acts, and holds the set-point back.
constexpr double kTouching = 0.6, kPlaced = 0.6, kLimited = 2;
constexpr double kNoDivision = 1e-6;
constexpr double kUsualDoubt_N = 1000;  // of a cylinder: standing friction and free motion leave less

}  // namespace

/// Least squares with the same weights as the compliance. What end stops or reliefs may take of a joint's torque is no
/// force of the world: such a joint counts the less.
PlanarVector ContactLaw::force_of(const PlanarJacobian& jacobian, const estimation::JointState& state,
                                  const estimation::ForceEstimate& force) const noexcept {
  const JointVector usual_Nm = kUsualDoubt_N * state.lever_m.cwiseAbs().cwiseMax(kLeastSureLever_m);
  const JointVector believed =
      usual_Nm.cwiseAbs2().cwiseQuotient(force.measurement_variance_Nm2.cwiseMax(usual_Nm.cwiseAbs2()));
  return PlanarInverse(jacobian, weight_.cwiseProduct(believed), kSingularity).force_N(force.fast_torque_Nm);
}

ContactLaw::ContactLaw(const MachineDescription& machine)
    : cylinders_(machine.cylinders),
      hydraulics_(machine.hydraulics),
      control_(machine.control),
      kinematics_(machine),
      weight_(machine.control.stiffness_radius_m.cwiseAbs2().cwiseInverse()),
      furthest_m_(machine.links[kBucket].length_m) {}

Eigen::Matrix<double, kJoints, 2> ContactLaw::to_joints(const PlanarJacobian& jacobian) const noexcept {
  return PlanarInverse(jacobian, weight_, kSingularity).matrix();
}

Touch ContactLaw::touch(const estimation::JointState& state, const estimation::ForceEstimate& force) const noexcept {
  Touch touch;
  touch.tip_jacobian = kinematics_.tip_jacobian(state.angle_rad);
  touch.force_N = force_of(touch.tip_jacobian, state, force);
  touch.normal = touch.force_N.stableNormalized();
  touch.confidence = force.confidence;
  // A small force does not say where it acts.
  const double placed_N = kPlaced * control_.feed_forward_fade_N;
  PlanarVector from_tip_m = force.fast_couple_Nm / (touch.force_N.squaredNorm() + placed_N * placed_N) *
                            PlanarVector(touch.force_N.y(), -touch.force_N.x());
  from_tip_m *= std::min(1.0, furthest_m_ / std::max(from_tip_m.norm(), 1e-6));
  touch.jacobian = beside_tip(touch.tip_jacobian, from_tip_m);
  return touch;
}

JointVector ContactLaw::compliance_rad(const Touch& touch) const noexcept {
  // Springs per joint (Kq_i = Ks L_i^2) would give a stiffness that varies more than twofold with direction and pose,
  // which the operator's spring, K_l = lambda mu Ks, cannot match. Pressures that cannot be explained must not move the
  // machine: a force that is not trusted is not complied with, and none without bound.
  PlanarVector force_N = trust(touch.confidence) * touch.force_N;
  force_N *= std::min(1.0, kLargestPress * control_.feed_forward_fade_N / std::max(force_N.norm(), 1.0));
  return to_joints(touch.jacobian) * force_N / control_.tip_stiffness_N_per_m;
}

JointVector ContactLaw::shortened_rad(const JointVector& lead_rad, const Touch& touch,
                                      double allowed_N) const noexcept {
  const double pressing_m = -touch.normal.dot(touch.jacobian * lead_rad);
  const double allowed_m = allowed_N / control_.tip_stiffness_N_per_m;
  if (pressing_m <= allowed_m) return lead_rad;
  // The whole lead is cut short, and the deeper it was the more with the joints that comply: where pressing and
  // compliance are in balance all joints then rest. Valves do not keep the balance of some that press and others that
  // comply. Where the force is not trusted its direction is not either: what leads along the contact goes on there, or
  // noise of the direction would switch it on and off.
  const double along_m = (1 - trust(touch.confidence)) * control_.feed_forward_fade_N / control_.tip_stiffness_N_per_m;
  const double share = (allowed_m + along_m) / (pressing_m + along_m);
  const double rest_m = allowed_m - share * share * pressing_m;
  return share * share * lead_rad + to_joints(touch.jacobian) * (-rest_m * touch.normal);
}

double ContactLaw::contact_probability(const Touch& touch, double most_N) const noexcept {
  const double from_N = std::min(kLimited * control_.feed_forward_fade_N, most_N / 2.5);
  return std::clamp(touch.force_N.norm() / from_N - 1, 0.0, 1.0);
}

JointVector ContactLaw::limited_lead_rad(const JointVector& lead_rad, const Touch& touch,
                                         const PlanarVector& rendered_N, double most_N, double contact_probability,
                                         double contact_compliance) const noexcept {
  if (contact_probability <= 0) return lead_rad;
  const double f1_N = control_.feed_forward_fade_N;
  // What is not complied with is not pressed on either, and counts for a wall.
  const double rendered_and_margin_N = trust(touch.confidence) * (std::max(0.0, touch.normal.dot(rendered_N)) + f1_N);
  const JointVector felt_rad = shortened_rad(lead_rad, touch, rendered_and_margin_N);
  const JointVector limited_lead_rad =
      lead_rad + contact_probability * (1 - trust(touch.confidence) * contact_compliance) * (felt_rad - lead_rad);
  return limited_lead_rad + contact_probability * (shortened_rad(limited_lead_rad, touch, most_N) - limited_lead_rad);
}

JointVector ContactLaw::slowed_radps(const JointVector& rate_radps, const Touch& touch,
                                     const PlanarVector& less_mps) const noexcept {
  return rate_radps - PlanarInverse(touch.jacobian, weight_, kNoDivision).joints(less_mps);
}

JointVector ContactLaw::steadied_radps(const JointVector& rate_radps, const Touch& touch,
                                       const estimation::JointState& state) const noexcept {
  const double touching = std::min(1.0, touch.force_N.norm() / (kTouching * control_.feed_forward_fade_N));
  JointVector oil_rad_per_Nm;
  for (int i = 0; i < kJoints; ++i) {
    const double length_m = kinematics_.cylinder_at(i, state.angle_rad[i]).value_or(CylinderState{}).length_m;
    const double lever_m = std::max(kLeastLever_m, std::abs(state.lever_m[i]));
    const auto& cylinder = cylinders_[static_cast<std::size_t>(i)];
    oil_rad_per_Nm[i] = 1 / (oil_stiffness_N_per_m(cylinder, hydraulics_, length_m) * lever_m * lever_m);
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> oil_m_per_N;
  oil_m_per_N.computeDirect(touch.jacobian * oil_rad_per_Nm.asDiagonal() * touch.jacobian.transpose());
  const double gain_1ps = std::max(control_.position_gain_1ps, control_.bucket_position_gain_1ps);
  const double stiffest_N_per_m = control_.contact_crossover_radps * control_.tip_stiffness_N_per_m / gain_1ps;
  const PlanarVector less = touching * (1 - (stiffest_N_per_m * oil_m_per_N.eigenvalues().array()).cwiseMin(1.0));
  const Eigen::Matrix2d& axes = oil_m_per_N.eigenvectors();
  const PlanarVector slower_mps = axes * less.asDiagonal() * axes.transpose() * (touch.jacobian * rate_radps);
  return slowed_radps(rate_radps, touch, slower_mps);
}

}  // namespace knuckle::slave
