// What the machine does where it touches something: it complies with the force at the point that is touched, presses no
// further than the hand is made to feel, and moves no faster than its own oil lets it stay steady. Equations:
// docs/theory.md.
#pragma once

#include <Eigen/Core>

#include "core/joints.h"
#include "estimation/force_estimator.h"
#include "estimation/joint_state.h"
#include "machine/description.h"
#include "machine/kinematics.h"
#include "machine/planar_jacobian.h"

namespace knuckle::slave {

/// One force of the world on the bucket, of the estimator's fast channel, and where it acts.
struct Touch {
  PlanarVector force_N = PlanarVector::Zero();  ///< Frame M.
  PlanarVector normal = PlanarVector::Zero();   ///< Its direction; zero without a force.
  PlanarJacobian tip_jacobian = PlanarJacobian::Zero();
  /// Of the point nearest to the tip on the force's line of action: along that line all points of the bucket move
  /// alike.
  PlanarJacobian jacobian = PlanarJacobian::Zero();
  double confidence = 0;
};

class ContactLaw {
 public:
  explicit ContactLaw(const MachineDescription& machine);

  [[nodiscard]] Touch touch(const estimation::JointState& state, const estimation::ForceEstimate& force) const noexcept;

  /// Pseudo-inverse of a point's Jacobian, weighted with 1/L_i^2 and regularised, so that an arm stretched towards the
  /// force gets stiff instead of wild.
  [[nodiscard]] Eigen::Matrix<double, kJoints, 2> to_joints(const PlanarJacobian& jacobian) const noexcept;

  /// Joint displacements that make the touched point comply with the force like a spring of stiffness Ks, in every
  /// direction; as far as the force is trusted, and never without bound.
  [[nodiscard]] JointVector compliance_rad(const Touch& touch) const noexcept;

  /// How sure it is that the force is one that holds the set-point back, [0, 1]. @param most_N as below.
  [[nodiscard]] double contact_probability(const Touch& touch, double most_N) const noexcept;

  /// How far the set-point leads, along the force no further than Ks makes (rendered force + F1) of it.
  /// @param lead_rad set-point minus joints. @param rendered_N MasterMessage::rendered_N. @param most_N what may be
  /// pressed in any case: beyond it the touched point draws back. @param contact_probability see above. @param
  /// contact_compliance [0, 1]: what moves along is pressed as far as the hand goes, up to most_N.
  [[nodiscard]] JointVector limited_lead_rad(const JointVector& lead_rad, const Touch& touch,
                                             const PlanarVector& rendered_N, double most_N, double contact_probability,
                                             double contact_compliance) const noexcept;

  /// With the touched point slower by less_mps (frame M), exactly where a regularised inverse would leave a rest.
  [[nodiscard]] JointVector slowed_radps(const JointVector& rate_radps, const Touch& touch,
                                         const PlanarVector& less_mps) const noexcept;

  /// The loop "rate -> oil -> force -> compliance" crosses over at Kp K / Ks, K the stiffness of the arm's oil at the
  /// touched point: up to 50 times Ks near the wrist. In the directions in which that is faster than valves and filters
  /// allow, the point's speed is made smaller by as much.
  [[nodiscard]] JointVector steadied_radps(const JointVector& rate_radps, const Touch& touch,
                                           const estimation::JointState& state) const noexcept;

 private:
  [[nodiscard]] PlanarVector force_of(const PlanarJacobian& jacobian, const estimation::JointState& state,
                                      const estimation::ForceEstimate& force) const noexcept;
  /// Lead that presses no more than allowed_N makes of Ks.
  [[nodiscard]] JointVector shortened_rad(const JointVector& lead_rad, const Touch& touch,
                                          double allowed_N) const noexcept;

  PerJoint<CylinderDescription> cylinders_;
  HydraulicsDescription hydraulics_;
  MachineDescription::Control control_;
  Kinematics kinematics_;
  JointVector weight_;
  double furthest_m_;
};

}  // namespace knuckle::slave
