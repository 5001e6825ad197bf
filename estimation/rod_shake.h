// Vibrations of rods that stand, of micrometres, which no wire encoder shows. Where the valve is shut a rod moves as
// its oil is pressed together, so the pressures show them: v = -F' / k. They are what releases the friction of seals at
// rest.
#pragma once

#include <cmath>
#include <numbers>

#include "core/filters.h"
#include "core/joints.h"
#include "machine/description.h"
#include "machine/oil_stiffness.h"

namespace knuckle::estimation {

class RodShake {
 public:
  RodShake(const MachineDescription& machine, double step_s) noexcept
      : step_s_(step_s),
        first_(kHighest_Hz, step_s, JointVector::Zero()),
        second_(kHighest_Hz, step_s, JointVector::Zero()),
        slow_(kLowest_Hz, step_s, JointVector::Zero()) {
    const SensorDescription& sensors = machine.sensors;
    const double noise_Pa = std::hypot(sensors.pressure_noise_Pa, sensors.pressure_step_Pa / std::sqrt(12.0));
    // Mean size of white noise that is differentiated behind two poles; a normal one's is sqrt(2 / pi) deviations.
    const double passed_1ps = 2 * std::numbers::pi * std::sqrt(step_s * std::pow(kHighest_Hz, 3));
    for (int i = 0; i < kJoints; ++i) {
      const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(i)];
      const double middle_m = (cylinder.min_length_m + cylinder.max_length_m) / 2;
      m_per_N_[i] = 1 / oil_stiffness_N_per_m(cylinder, machine.hydraulics, middle_m);
      noise_mps_[i] =
          passed_1ps * m_per_N_[i] * noise_Pa * std::hypot(cylinder.head_area_m2(), cylinder.rod_side_area_m2());
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
    const JointVector shaken = (moved - slow_.step(moved)).cwiseAbs();
    speed_mps_ = (shaken - kNoise * noise_mps_).cwiseMax(0.0);
  }
  /// How fast a rod shakes, beyond what its transmitters' noise explains.
  [[nodiscard]] double speed_mps(int joint) const noexcept { return speed_mps_[joint]; }

 private:
  /// Above is noise. Below, encoders see the motion, and leakage lets a rod move at the same pressure.
  static constexpr double kHighest_Hz = 15, kLowest_Hz = 2;
  /// Of noise's mean size, taken for no shaking. With 1, friction in presses is released that is there: 3 % fewer of
  /// them are stable.
  static constexpr double kNoise = 2;
  double step_s_;
  LowPass<JointVector> first_, second_, slow_;
  JointVector m_per_N_ = JointVector::Zero(), noise_mps_ = JointVector::Zero();
  JointVector last_N_ = JointVector::Zero(), speed_mps_ = JointVector::Zero();
};

}  // namespace knuckle::estimation
