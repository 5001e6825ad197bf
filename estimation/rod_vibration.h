// Vibrations of rods that stand, smaller than a step of the wire encoders, from pressures. Where the valve is shut a
// rod moves as its oil is pressed together: v = -F' / k. They are what releases the friction of seals at rest.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/filters.h"
#include "core/joints.h"
#include "machine/description.h"
#include "machine/oil_stiffness.h"

namespace knuckle::estimation {

/// An open valve changes the force of a rod that stands, too: an oscillation at the valve is taken for one of the rod.
/// So is what of a pump's ripple sampling folds into the band.
class RodVibration {
 public:
  RodVibration(const MachineDescription& machine, double step_s) noexcept
      : step_s_(step_s),
        first_(kHighest_Hz, step_s, JointVector::Zero()),
        second_(kHighest_Hz, step_s, JointVector::Zero()),
        slow_(kLowest_Hz, step_s, JointVector::Zero()) {
    const SensorDescription& sensors = machine.sensors;
    const double noise_Pa = std::hypot(sensors.pressure_noise_Pa, sensors.pressure_step_Pa / std::sqrt(12.0));
    const double pole = std::exp(-2 * std::numbers::pi * kHighest_Hz * step_s);
    // Deviation of white noise that is differentiated behind two poles, and the peak of a single step.
    const double noise_1ps = (1 - pole) / step_s * std::sqrt(2 * (1 - pole) / std::pow(1 + pole, 3));
    const double one_step_1ps = 2 * std::numbers::pi * kHighest_Hz / std::numbers::e;
    const double quiet_Paps = std::max(kQuiet * noise_1ps * noise_Pa, one_step_1ps * sensors.pressure_step_Pa);
    for (int i = 0; i < kJoints; ++i) {
      const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(i)];
      const double middle_m = (cylinder.min_length_m + cylinder.max_length_m) / 2;
      m_per_N_[i] = 1 / oil_stiffness_N_per_m(cylinder, machine.hydraulics, middle_m);
      quiet_mps_[i] = quiet_Paps * m_per_N_[i] * std::hypot(cylinder.head_area_m2(), cylinder.rod_side_area_m2());
    }
  }

  /// The machine is at rest.
  void reset(const JointVector& cylinder_N) noexcept {
    last_N_ = cylinder_N;
    first_.reset(JointVector::Zero());
    second_.reset(JointVector::Zero());
    slow_.reset(JointVector::Zero());
    speed_mps_.setZero();
  }
  /// @param cylinder_N p_A A_A - p_B A_B, as measured.
  void step(const JointVector& cylinder_N) noexcept {
    const JointVector rate = second_.step(first_.step((last_N_ - cylinder_N) / step_s_));
    last_N_ = cylinder_N;
    const JointVector moved = m_per_N_.cwiseProduct(rate);
    speed_mps_ = ((moved - slow_.step(moved)).cwiseAbs() - quiet_mps_).cwiseMax(0.0);
  }
  /// Either way, beyond what the transmitters' noise explains. The stiffness is that of the middle of the stroke: near
  /// its ends oil is up to 3.6 times as stiff, and a rod slower by as much than is said here.
  [[nodiscard]] const JointVector& speed_mps() const noexcept { return speed_mps_; }

 private:
  /// Above is noise. Below, encoders see the motion, and leakage lets a rod move at the same pressure.
  static constexpr double kHighest_Hz = 15, kLowest_Hz = 2;
  /// Standard deviations of noise that are taken for no vibration. With half as many, friction in presses is released
  /// that is there: 3 % fewer of them are stable.
  static constexpr double kQuiet = 1.7;
  double step_s_;
  LowPass<JointVector> first_, second_, slow_;
  JointVector m_per_N_ = JointVector::Zero(), quiet_mps_ = JointVector::Zero();
  JointVector last_N_ = JointVector::Zero(), speed_mps_ = JointVector::Zero();
};

}  // namespace knuckle::estimation
