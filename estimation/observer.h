// The momentum observer and what feeds it: speed and friction's bristles behind one velocity filter.
#pragma once

#include <array>
#include <numbers>

#include "core/filters.h"
#include "core/joints.h"
#include "estimation/foh_filter.h"
#include "estimation/friction.h"

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
    external_Nm_ = imbalance_Nm;
  }
  const JointVector& step(const JointVector& momentum, const JointVector& imbalance_Nm) noexcept {
    external_Nm_ = gain_ * (momentum - momentum_.step(momentum)) + imbalance_.step(imbalance_Nm);
    return external_Nm_;
  }

 private:
  double gain_;
  FohFilter<JointVector> momentum_, imbalance_;
  JointVector external_Nm_ = JointVector::Zero();
};

/// Bandwidth of a channel: observer behind two equal velocity poles.
struct ChannelBand {
  double observer_Hz, velocity_Hz;
};

/// Speed, bristles and observer of one bandwidth.
struct ObserverChannel {
  ObserverChannel(const ChannelBand& band, double step_s) noexcept
      : period_s(step_s),
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
  /// @param held the world holds the bucket.
  void move(const JointVector& joint_step_rad, const JointVector& new_lever_m, bool held) noexcept {
    lever_m = new_lever_m;
    cylinder_mps = lever_m.cwiseProduct(rate.step(first.step(joint_step_rad / period_s)));
    for (int i = 0; i < kJoints; ++i) {
      DahlState& state = dahl[static_cast<std::size_t>(i)];
      state.step(cylinder_mps[i], period_s, held ? kHeldTurn_m : DahlState::kTurnDistance_m);
      bristle[i] = state.settle(cylinder_mps[i], period_s, held ? kHeldSettling_s : DahlState::kSettling_s);
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
  /// What holds the bucket lets nothing ring: bristles stay bent while a rod stands, or creeps by a millimetre. Their
  /// distance is longer than the seal's because encoders show a creep in steps, and of some rods that stand as well.
  /// Measured on simulated machines: 5 to 10 s and 0.2 to 0.6 mm do about as well.
  static constexpr double kHeldSettling_s = 10, kHeldTurn_m = 3e-4;
  double period_s;
  /// Two equal poles: behind one, each 0.1 mm step of a wire encoder is a jolt of 500 N m to the boom's momentum.
  LowPass<JointVector> first;
  FohFilter<JointVector> rate;
  std::array<DahlState, kJoints> dahl{};
  JointVector lever_m = JointVector::Zero(), cylinder_mps = JointVector::Zero(), bristle = JointVector::Zero();
  MomentumObserver observer;
};

}  // namespace knuckle::estimation
