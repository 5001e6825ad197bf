// A cue while digging: the bucket has met something much stiffer than soil - a pipe, a cable duct, a foundation.
#pragma once

#include <array>

#include "core/joints.h"
#include "estimation/force_estimator.h"
#include "estimation/joint_state.h"
#include "estimation/observer.h"
#include "machine/kinematics.h"

namespace knuckle::estimation {

/// Soil resists in proportion to how far the edge has moved on: 2e4 to 1e5 N/m along the motion, whatever the speed.
/// A steel or concrete pipe (5e6 N/m) stops the tip within a millimetre while the cylinders still push, so the force
/// along the motion rises by a kilonewton over next to no travel. The cue comes where, after kDugPath_m of digging in
/// one direction, within kWindow_s
///   - the force against the motion has risen beyond its largest value of the third of a second before, by kRise_N
///     and kRiseSigmas standard deviations,
///   - by more than kStiffness_N_per_m times the way the tip has come in that time, and
///   - the tip has lost half of its speed.
/// Force and way come through the same filters, so that a spring shows its own stiffness although both are late.
/// Reversals (soil's friction turns round at once) and pressing again on soil already pressed are not digging yet:
/// the path starts anew with each change of direction. A wall met in free air is a contact, not this.
class BuriedObjectCue {
 public:
  static constexpr double kDugPath_m = 0.03;    ///< In one direction, against at least kDigging_N.
  static constexpr double kDigging_N = 200;     ///< Of force against the motion.
  static constexpr double kSlowest_mps = 0.02;  ///< Of the tip, for a direction to be known.
  static constexpr double kWindow_s = 0.06;     ///< Of rise and travel.
  static constexpr double kMemory_s = 0.5;      ///< Of the highest speed and of a path without force.
  static constexpr double kRise_N = 450;        ///< A tip that grazes a pipe in a soft hand shows 600.
  static constexpr double kRiseSigmas = 4;
  static constexpr double kStiffness_N_per_m = 1.5e5;  ///< Half as much again as the stiffest soil.
  static constexpr double kResolution_m = 1e-3;        ///< Of the way: an encoder step, seen at the tip.
  static constexpr double kLetGo = 0.5;                ///< The cue ends below this part of the force it came with.

  /// @throws InputError as Kinematics does.
  BuriedObjectCue(const MachineDescription& machine, double step_s);

  /// One step of the slave loop, after the force estimator's; both of the same moment.
  /// @return true from the step in which the object was felt until the force on it has let go.
  bool step(const JointState& state, const ForceEstimate& force) noexcept;

  [[nodiscard]] bool on() const noexcept { return on_; }
  /// Of the object met last, as far as the filters let it be seen: a lower bound. 0 before the first.
  [[nodiscard]] double stiffness_N_per_m() const noexcept { return stiffness_N_per_m_; }
  /// The sensors were away: the next step starts at rest.
  void restart_motion() noexcept { started_ = false; }

 private:
  static constexpr int kSamples = 64;
  struct Sample {
    PlanarVector tip_m = PlanarVector::Zero(), force_N = PlanarVector::Zero();
  };
  /// @param age in steps, 1 (the newest) to kSamples.
  [[nodiscard]] const Sample& sample(int age) const noexcept {
    return past_[static_cast<std::size_t>((oldest_ + kSamples - age) % kSamples)];
  }
  void follow(const PlanarVector& tip_mps, double against_N) noexcept;
  [[nodiscard]] bool met(const Sample& now, double speed_mps, double sigma_N) noexcept;

  Kinematics kinematics_;
  double step_s_;
  int window_;
  bool started_ = false, on_ = false;
  FohFilter<PlanarVector> first_, second_, third_;  ///< Twins of the fast torque's filters.
  std::array<Sample, kSamples> past_{};             ///< A ring.
  int oldest_ = 0;
  PlanarVector direction_ = PlanarVector::Zero();  ///< Of the digging, unit; zero where there is none.
  double path_m_ = 0, fastest_mps_ = 0;
  double held_N_ = 0, stiffness_N_per_m_ = 0;
};

}  // namespace knuckle::estimation
