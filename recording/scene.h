// The machine and its forces as Foxglove draws them in 3-D: where its frames are, what moves along with them, and what
// changes: cylinders, force, contact, load.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/time.h"
#include "machine/description.h"
#include "machine/kinematics.h"
#include "recording/scene_entities.h"
#include "slave/slave_state.h"

namespace knuckle::recording {

/// Draws one machine. Frames: "machine" is M, without the hull's pitch; within it "ground", where the tracks stand, and
/// "boom"; within each other "arm", "bucket" and "tip", each at its joint with x along the link.
class SceneWriter {
 public:
  /// Below this confidence a force is no number.
  static constexpr double kKnown = 0.3;

  /// @param machine as calibrated().
  explicit SceneWriter(const MachineDescription& machine);

  // Messages. @param unix_ns of session time 0. Valid until the next call.
  /// foxglove_msgs/FrameTransforms: all frames.
  [[nodiscard]] std::span<const std::uint8_t> transforms(const slave::SlaveState& state, std::int64_t unix_ns);
  /// foxglove_msgs/SceneUpdate: all that changes. The force is an arrow from the tip, coloured by confidence; around
  /// its end lies the 95 % ellipse, to the same scale, which a note of the entity says.
  [[nodiscard]] std::span<const std::uint8_t> scene(const slave::SlaveState& state, std::int64_t unix_ns);
  /// foxglove_msgs/SceneUpdate: links, bucket and ground, each fixed to its frame. A topic of its own: who seeks is
  /// shown the last message of each topic. Empty but once a second.
  [[nodiscard]] std::span<const std::uint8_t> machine(const slave::SlaveState& state, std::int64_t unix_ns);

 private:
  void put_cylinders(CdrWriter& out, std::int64_t at_ns, const MachinePose& pose) const;
  void put_force(CdrWriter& out, std::int64_t at_ns, const PlanarVector& tip_m, const slave::SlaveState& state) const;
  void put_contact(CdrWriter& out, std::int64_t at_ns, const PlanarVector& tip_m) const;
  void put_load(CdrWriter& out, std::int64_t at_ns, const MachinePose& pose, const slave::SlaveState& state) const;
  void put_link(CdrWriter& out, std::int64_t at_ns, int joint) const;
  void put_bucket(CdrWriter& out, std::int64_t at_ns) const;
  void put_ground(CdrWriter& out, std::int64_t at_ns) const;
  [[nodiscard]] Solid ellipse(const PlanarVector& centre_m, const std::array<double, 3>& covariance_N2) const;

  MachineDescription machine_;
  double reach_m_;
  double newtons_per_m_;  // of arrow
  std::string scale_;
  std::array<Eigen::Vector3d, 12> bucket_m_;  // its outline, on the right and on the left
  std::vector<std::uint8_t> room_;
  Time machine_at_ = kNever;  // last drawn
};

}  // namespace knuckle::recording
