// The momentum observer and what feeds it: speed and friction's bristles behind one velocity filter.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/filters.h"
#include "core/joints.h"
#include "estimation/foh_filter.h"
#include "estimation/friction.h"
#include "estimation/rod_vibration.h"

namespace knuckle::estimation {

/// External joint torque e = a (p - F p) + F u of gain a, with p the momentum and u = (velocity products + gravity +
/// friction - cylinder torque): the residual of the filtered regressor, Q replaced by what cylinders and friction give.
class MomentumObserver {
 public:
  MomentumObserver(double cutoff_Hz, double step_s) noexcept
      : gain_(2.0 * std::numbers::pi * cutoff_Hz), momentum_(cutoff_Hz, step_s), imbalance_(cutoff_Hz, step_s) {}
  void reset(const JointVector& momentum, const JointVector& imbalance_Nm) noexcept {
    momentum_.reset(momentum);
    imbalance_.reset(imbalance_Nm);
    inertial_Nm_.setZero();
    external_Nm_ = imbalance_Nm;
  }
  const JointVector& step(const JointVector& momentum, const JointVector& imbalance_Nm) noexcept {
    inertial_Nm_ = gain_ * (momentum - momentum_.step(momentum));
    external_Nm_ = inertial_Nm_ + imbalance_.step(imbalance_Nm);
    return external_Nm_;
  }
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
  /// @param encoder_step_m of the rods' encoders.
  ObserverChannel(const ChannelBand& band, double step_s, double encoder_step_m) noexcept
      : period_s(step_s),
        one_step_mps(encoder_step_m * 2 * std::numbers::pi * band.velocity_Hz / std::numbers::e),
        one_step_share(std::min(1.0, DahlState::kTurnDistance_m / (kStepsToTurn * encoder_step_m))),
        first(band.velocity_Hz, step_s, JointVector::Zero()),
        rate(band.velocity_Hz, step_s),
        observer(band.observer_Hz, step_s) {
    rest();
  }
  /// No speed, and bristles that are not bent either way. The observer starts with the pose.
  void rest() noexcept {
    first.reset(JointVector::Zero());
    rate.reset(JointVector::Zero());
    dahl = {};
  }
  /// @param vibration_mps of rods, from pressures, for those that stand or creep. @param held the world holds the
  /// bucket: what little vibrates then, pressures show. In free air a rod always vibrates, also by less than they show.
  void move(const JointVector& joint_step_rad, const JointVector& new_lever_m, const JointVector& vibration_mps,
            bool held) noexcept {
    lever_m = new_lever_m;
    cylinder_mps = lever_m.cwiseProduct(rate.step(first.step(joint_step_rad / period_s)));
    for (int i = 0; i < kJoints; ++i) {
      DahlState& state = dahl[static_cast<std::size_t>(i)];
      const double seen_mps = cylinder_mps[i];
      const bool stands = held && std::abs(seen_mps) <= one_step_mps;
      state.step(stands ? one_step_share * seen_mps : seen_mps, period_s);
      if (stands) state.release(std::max(0.0, vibration_mps[i] - kOneWay * std::abs(seen_mps)) * period_s);
      if (!held) state.settle(seen_mps, period_s);
      bristle[i] = state.value();
    }
  }
  /// @param cylinder_Nm joint torque of the pressures, as late as the speed; @param pressure_sum_Pa likewise. @return
  /// joint torque of friction, to be taken off it.
  [[nodiscard]] JointVector friction_Nm(const PerJoint<CylinderFriction>& friction, const JointVector& cylinder_Nm,
                                        const JointVector& pressure_sum_Pa) const noexcept {
    JointVector torque;
    for (int i = 0; i < kJoints; ++i) {
      const double cylinder_N = cylinder_Nm[i] / (lever_m[i] + (lever_m[i] < 0 ? -kTinyLever_m : kTinyLever_m));
      torque[i] = lever_m[i] * friction[static_cast<std::size_t>(i)].force_N(bristle[i], cylinder_mps[i], cylinder_N,
                                                                             pressure_sum_Pa[i]);
    }
    return torque;
  }

  static constexpr double kTinyLever_m = 1e-6;
  /// Encoders show a creep in steps, and of some rods that stand as well. A friction that turns with each of them keeps
  /// a press from standing still (docs/theory.md): as slowly as a single step can look, so many of them
  /// turn it, or the bristles' own distance where that is more.
  static constexpr double kStepsToTurn = 8;
  /// What vibrates less than it goes one way is not released. All of the speed that encoders show cannot be taken off,
  /// since of a rod that vibrates by a step they show steps, too: pulls would be known half as well.
  static constexpr double kOneWay = 0.3;
  double period_s;
  double one_step_mps;    ///< What a single step of an encoder looks like at most, behind the two poles.
  double one_step_share;  ///< Of such a speed, that is taken for the rod's.
  /// Two equal poles: behind one, each 0.1 mm step of a wire encoder is a jolt of 500 N m to the boom's momentum.
  LowPass<JointVector> first;
  FohFilter<JointVector> rate;
  std::array<DahlState, kJoints> dahl{};
  JointVector lever_m = JointVector::Zero(), cylinder_mps = JointVector::Zero(), bristle = JointVector::Zero();
  MomentumObserver observer;
};

}  // namespace knuckle::estimation
