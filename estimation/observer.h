// The momentum observer and what feeds it: speed and friction's bristles behind one velocity filter.
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <type_traits>

#include "core/filters.h"
#include "core/joints.h"
#include "estimation/friction.h"
#include "machine/description.h"

namespace knuckle::estimation {

// First-order low-pass that is exact for inputs straight between samples (first-order hold): the F(s) = a / (s + a) of
// the filtered regressor and of the momentum observer.

/// y+ = lambda y + b0 u+ + b1 u with lambda = exp(-aT), b0 = 1 - (1 - lambda)/(aT), b1 = (1 - lambda)/(aT) - lambda.
/// T is double or a fixed-size Eigen array or vector.
template <typename T>
class FohFilter {
 public:
  FohFilter(double cutoff_Hz, double step_s) noexcept {
    const double at = 2.0 * std::numbers::pi * cutoff_Hz * step_s;
    lambda_ = std::exp(-at);
    b0_ = 1.0 - (1.0 - lambda_) / at;
    b1_ = (1.0 - lambda_) / at - lambda_;
  }
  /// Output 0 so far, input from now on.
  void start(const T& input) noexcept {
    input_ = input;
    value_ = zero();
  }
  /// As if the input had been `input` for ever.
  void reset(const T& input) noexcept { input_ = value_ = input; }
  const T& step(const T& input) noexcept {
    value_ = lambda_ * value_ + b0_ * input + b1_ * input_;
    input_ = input;
    return value_;
  }
  [[nodiscard]] const T& value() const noexcept { return value_; }

 private:
  /// T() of an Eigen type is whatever was in memory.
  static T zero() noexcept {
    if constexpr (std::is_arithmetic_v<T>) {
      return 0;
    } else {
      return T::Zero();
    }
  }

  double lambda_, b0_, b1_;
  T value_ = zero(), input_ = zero();
};

// Vibrations of rods that stand, smaller than a step of the wire encoders, from pressures. Where the valve is shut a
// rod moves as its oil is pressed together: v = -F' / k. They are what releases the friction of seals at rest.

/// An open valve changes the force of a rod that stands, too: an oscillation at the valve is taken for one of the rod.
/// So is what of a pump's ripple sampling folds into the band.
class RodVibration {
 public:
  RodVibration(const MachineDescription& machine, double step_s) noexcept;

  /// The machine is at rest.
  void reset(const JointVector& cylinder_N) noexcept;
  /// @param cylinder_N p_A A_A - p_B A_B, as measured.
  void step(const JointVector& cylinder_N) noexcept;
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

/// External joint torque e = a (p - F p) + F u of gain a, with p the momentum and u = (velocity products + gravity +
/// friction - cylinder torque): the residual of the filtered regressor, Q replaced by what cylinders and friction give.
class MomentumObserver {
 public:
  MomentumObserver(double cutoff_Hz, double step_s) noexcept
      : gain_(2.0 * std::numbers::pi * cutoff_Hz), momentum_(cutoff_Hz, step_s), imbalance_(cutoff_Hz, step_s) {}
  void reset(const JointVector& momentum, const JointVector& imbalance_Nm) noexcept;
  const JointVector& step(const JointVector& momentum, const JointVector& imbalance_Nm) noexcept;
  [[nodiscard]] const JointVector& inertial_Nm() const noexcept { return inertial_Nm_; }  ///< a (p - F p) = F p'

 private:
  double gain_;
  FohFilter<JointVector> momentum_, imbalance_;
  JointVector inertial_Nm_ = JointVector::Zero(), external_Nm_ = JointVector::Zero();
};

/// Bandwidth of a channel: observer behind two equal velocity poles.
struct ChannelBand {
  double observer_Hz, velocity_Hz;
};

/// Speed, bristles and observer of one bandwidth.
struct ObserverChannel {
  /// @param length_step_m length_steps_m() of the machine.
  ObserverChannel(const ChannelBand& band, double step_s, const JointVector& length_step_m) noexcept;
  /// No speed, and bristles that are not bent either way. The observer starts with the pose.
  void rest() noexcept;
  /// @param vibration_mps of rods, from pressures, for those that stand or creep. @param held the world holds the
  /// bucket: what little vibrates then, pressures show. In free air a rod always vibrates, also by less than they show.
  void move(const JointVector& joint_step_rad, const JointVector& new_lever_m, const JointVector& vibration_mps,
            bool held) noexcept;
  /// @param cylinder_Nm joint torque of the pressures, as late as the speed; @param pressure_sum_Pa likewise. @return
  /// joint torque of friction, to be taken off it.
  [[nodiscard]] JointVector friction_Nm(const PerJoint<CylinderFriction>& friction, const JointVector& cylinder_Nm,
                                        const JointVector& pressure_sum_Pa) const noexcept;

  static constexpr double kTinyLever_m = 1e-6;
  /// Encoders show a creep in steps, and of some rods that stand as well. A friction that turns with each of them keeps
  /// a press from standing still (docs/theory.md): as slowly as a single step can look, so many of them
  /// turn it, or the bristles' own distance where that is more.
  static constexpr double kStepsToTurn = 8;
  /// What vibrates less than it goes one way is not released. All of the speed that encoders show cannot be taken off,
  /// since of a rod that vibrates by a step they show steps, too: pulls would be known half as well.
  static constexpr double kOneWay = 0.3;
  double period_s;
  JointVector one_step_mps;    ///< What a single step of an encoder looks like at most, behind the two poles.
  JointVector one_step_share;  ///< Of such a speed, that is taken for the rod's.
  /// Two equal poles: behind one, each 0.1 mm step of a wire encoder is a jolt of 500 N m to the boom's momentum.
  LowPass<JointVector> first;
  FohFilter<JointVector> rate;
  std::array<DahlState, kJoints> dahl{};
  JointVector lever_m = JointVector::Zero(), cylinder_mps = JointVector::Zero(), bristle = JointVector::Zero();
  MomentumObserver observer;
};

}  // namespace knuckle::estimation
