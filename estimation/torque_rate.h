// What the rates of the cylinders' torques tell: how the links move that no encoder sees, and what transmitters miss
// that are late.
#pragma once

#include <Eigen/Dense>
#include <numbers>

#include "core/joints.h"
#include "estimation/foh_filter.h"

namespace knuckle::estimation {

/// Columns of the bias filter: what an observer's torque lacks by what yields at each joint [per rad/(N m)], and by the
/// lag that all transmitters have [per s].
using UnseenColumns = Eigen::Matrix<double, kJoints, kJoints + 1>;

/// Pins, steel and the ground under the tracks yield to the torques of the cylinders, whose lengths the encoders
/// measure in front of all that. A link is behind its encoder by c tau, tau the cylinder's torque on its joint and c
/// [rad/(N m)] the compliance of what lies between, the hull on its tracks included: the boom's torque turns it and
/// with it everything. Far below the frequencies of hull and steel (8 Hz and more) that holds at every moment, so the
/// links move by -c tau' in addition. Of that motion's momentum -M c tau' the observer makes -M c a (tau' - F tau'),
/// which is linear in c.
///
/// Transmitters that answer with the time constant T read tau where tau + T tau' is: the observer's torque lacks -T F
/// tau', linear in T. Exactly it is lever times the force's rate; the lever's own, which is in tau', is some 4 N m at a
/// fast boom of the 1.5 t class.
///
/// F tau' = a (tau - F tau), and a (tau' - F tau') is its rate: a difference of samples, half a step late, is taken
/// only where it has to be. Half a step of T F tau' would be a fifth of it at the edge of the contact channel.
class TorqueRate {
 public:
  TorqueRate(double observer_Hz, double step_s) noexcept
      : gain_(2.0 * std::numbers::pi * observer_Hz), step_s_(step_s), torque_(observer_Hz, step_s) {}
  void reset(const JointVector& cylinder_Nm) noexcept {
    torque_.reset(cylinder_Nm);
    late_rate_Nmps_.setZero();
    shaken_Nmps2_.setZero();
  }
  /// @param cylinder_Nm torques of the pressures, as late as the channel's speed.
  void step(const JointVector& cylinder_Nm) noexcept {
    const JointVector before_Nmps = late_rate_Nmps_;
    late_rate_Nmps_ = gain_ * (cylinder_Nm - torque_.step(cylinder_Nm));
    shaken_Nmps2_ = (late_rate_Nmps_ - before_Nmps) / step_s_;
  }
  /// @param inertia_kgm2 M of the relative joints, in this pose.
  [[nodiscard]] UnseenColumns columns(const Eigen::Matrix3d& inertia_kgm2) const noexcept {
    UnseenColumns columns;
    columns << -inertia_kgm2 * shaken_Nmps2_.asDiagonal(), -late_rate_Nmps_;
    return columns;
  }

 private:
  double gain_, step_s_;
  FohFilter<JointVector> torque_;
  JointVector late_rate_Nmps_ = JointVector::Zero();  ///< F tau'
  JointVector shaken_Nmps2_ = JointVector::Zero();    ///< a (tau' - F tau')
};

}  // namespace knuckle::estimation
