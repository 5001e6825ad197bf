// What the rates of the cylinders' torques tell: how the links move that no encoder sees, and what transmitters miss
// that are late.
#pragma once

#include <numbers>

#include "core/joints.h"
#include "estimation/foh_filter.h"

namespace knuckle::estimation {

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
class TorqueRate {
 public:
  TorqueRate(double observer_Hz, double step_s) noexcept
      : gain_(2.0 * std::numbers::pi * observer_Hz), step_s_(step_s), late_(observer_Hz, step_s) {}
  void reset(const JointVector& cylinder_Nm) noexcept {
    last_Nm_ = cylinder_Nm;
    rate_Nmps_.setZero();
    shaken_Nmps2_.setZero();
    late_.reset(JointVector::Zero());
  }
  /// @param cylinder_Nm torques of the pressures, as late as the channel's speed.
  void step(const JointVector& cylinder_Nm) noexcept {
    rate_Nmps_ = (cylinder_Nm - last_Nm_) / step_s_;
    last_Nm_ = cylinder_Nm;
    shaken_Nmps2_ = gain_ * (rate_Nmps_ - late_.step(rate_Nmps_));
  }
  [[nodiscard]] const JointVector& rate_Nmps() const noexcept { return rate_Nmps_; }          ///< tau'
  [[nodiscard]] const JointVector& late_rate_Nmps() const noexcept { return late_.value(); }  ///< F tau'
  [[nodiscard]] const JointVector& shaken_Nmps2() const noexcept { return shaken_Nmps2_; }    ///< a (tau' - F tau')

 private:
  double gain_, step_s_;
  FohFilter<JointVector> late_;
  JointVector last_Nm_ = JointVector::Zero(), rate_Nmps_ = JointVector::Zero(), shaken_Nmps2_ = JointVector::Zero();
};

}  // namespace knuckle::estimation
