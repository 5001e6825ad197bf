// The test rig: poses that a machine takes, known forces that it can hold there, and the paths along which it is pulled
// at. What estimators are judged by, from recordings (trials.h) and while the machine's side runs (running_pulls.cpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "app/motion/path_builder.h"
#include "core/joints.h"
#include "estimation/regressor.h"
#include "machine/description.h"
#include "machine/kinematics.h"
#include "sim/truth.h"

namespace knuckle::studies {

/// One known pull: grows, is held, goes. Judged by the mean over the end of the hold.
struct Press {
  PlanarVector force_N = PlanarVector::Zero();  ///< Frame M, on the machine.
  bool creeping = false;                        ///< The tip creeps at 1-2 cm/s meanwhile; else the path stands still.
  std::size_t judge_from = 0, judge_to = 0;     ///< Samples of the recording.
};

class Sampler {
 public:
  explicit Sampler(std::uint64_t seed) : generator_(seed) {}
  double within(double low, double high) { return std::uniform_real_distribution<double>(low, high)(generator_); }

 private:
  std::mt19937_64 generator_;
};

/// Poses and loads that the machine can hold.
class Rig {
 public:
  /// @param machine as the controller sees it. @param hull that must not be pulled over on compliant ground.
  Rig(const MachineDescription& machine, const sim::HullTruth& hull, double step_s, std::uint64_t seed);

  /// Inside the working range, away from its ends and from the straight arm.
  JointVector pose();
  /// Time for a move at this speed of the fastest cylinder.
  [[nodiscard]] double duration_s(const JointVector& from, const JointVector& to, double cylinder_mps) const;
  /// How far the machine creeps towards another pose in the time of a pull.
  [[nodiscard]] JointVector crept(const JointVector& from, const JointVector& towards) const;
  /// A pull of 1-5 kN anywhere that this pose can hold at the tip.
  PlanarVector pull(const JointVector& pose_rad);
  /// Likewise in this direction (frame M), beside the tip by from_tip_m (bucket axes); nullopt where it holds hardly
  /// any.
  std::optional<PlanarVector> pull(const JointVector& pose_rad, double angle_rad,
                                   const PlanarVector& from_tip_m = PlanarVector::Zero());
  [[nodiscard]] Sampler& sampler() noexcept { return sampler_; }
  [[nodiscard]] double step_s() const noexcept { return step_s_; }

 private:
  [[nodiscard]] bool holds(const JointVector& q, const PlanarVector& force, const PlanarVector& from_tip_m) const;
  [[nodiscard]] bool stands(double boom_Nm, const PlanarVector& force) const;

  MachineDescription machine_;
  sim::HullTruth hull_;
  Kinematics kinematics_;
  estimation::BaseParameters weight_;
  double step_s_;
  Sampler sampler_;
};

/// A path with pulls on it, for MachineRun::follow().
class PullPath {
 public:
  PullPath(const JointVector& start_rad, double step_s) : builder_(start_rad, step_s) {}

  void go_to(const JointVector& pose_rad, double duration_s);
  /// Rests, is pulled at where it is, or while it creeps to another pose, and rests.
  void pull(const PlanarVector& force_N, const std::optional<JointVector>& creep_to_rad);
  [[nodiscard]] const JointVector& at() const noexcept { return builder_.at(); }
  [[nodiscard]] const estimation::JointPath& path() const noexcept { return builder_.path(); }
  [[nodiscard]] const std::vector<Press>& presses() const noexcept { return presses_; }
  /// One a sample.
  [[nodiscard]] std::vector<PlanarVector> pull_N() const;

 private:
  motion::PathBuilder builder_;
  std::vector<Press> presses_;
  std::vector<std::size_t> starts_;
};

}  // namespace knuckle::studies
