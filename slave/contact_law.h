// What the machine does in contact: the touched point complies with the force, presses no further than the hand is made
// to feel, and moves no faster than the stiffness of the oil lets the loop stay stable. Equations and symbols (F1, Ks,
// L_i): docs/theory.md, "The machine's law".
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
  PlanarVector normal = PlanarVector::Zero();   ///< Direction of force_N; zero without a force.
  PlanarJacobian tip_jacobian = PlanarJacobian::Zero();
  /// Of the touched point: the point nearest to the tip on the force's line of action. (All points of that line have
  /// the same speed along it.)
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

  /// Joint displacements by which the touched point gives way by force / Ks, in the direction of the force. The force
  /// counts times its trust, and up to 10 F1.
  [[nodiscard]] JointVector compliance_rad(const Touch& touch) const noexcept;

  /// [0, 1]: 0 up to the force from which on the set-point is limited, 1 from twice that force on.
  /// @param most_N as for limited_lead_rad().
  [[nodiscard]] double contact_probability(const Touch& touch, double most_N) const noexcept;

  /// The set-point limit: against the force, the touched point's lead is at most (rendered force + F1) / Ks.
  /// @param lead_rad set-point minus joint angles. @param rendered_N MasterMessage::rendered_N. @param most_N the most
  /// that may be pressed: beyond it the touched point draws back. @param contact_probability how much of the limit
  /// applies. @param contact_compliance [0, 1]: at 1 only most_N limits the lead.
  [[nodiscard]] JointVector limited_lead_rad(const JointVector& lead_rad, const Touch& touch,
                                             const PlanarVector& rendered_N, double most_N, double contact_probability,
                                             double contact_compliance) const noexcept;

  /// Rates with which the touched point is slower by exactly less_mps (frame M): the inverse is not regularised.
  [[nodiscard]] JointVector slowed_radps(const JointVector& rate_radps, const Touch& touch,
                                         const PlanarVector& less_mps) const noexcept;

  /// Slows the touched point in the directions in which the loop "rate -> oil -> force -> compliance" would cross over
  /// above contact_crossover_radps. It crosses over at Kp K / Ks, K the stiffness of the arm's oil at the touched
  /// point: up to 50 Ks at the back of the bucket.
  [[nodiscard]] JointVector steadied_radps(const JointVector& rate_radps, const Touch& touch,
                                           const estimation::JointState& state) const noexcept;

 private:
  [[nodiscard]] PlanarVector force_of(const PlanarJacobian& jacobian, const estimation::JointState& state,
                                      const estimation::ForceEstimate& force) const noexcept;
  /// Lead whose part against the force is at most allowed_N / Ks.
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
