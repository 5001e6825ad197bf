// The machine and its forces as Foxglove draws them in 3-D: where its frames are, what moves along with them, and what
// changes: cylinders, force, contact, load.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/joints.h"
#include "core/time.h"
#include "machine/description.h"
#include "machine/kinematics.h"
#include "recording/cdr.h"
#include "slave/slave_state.h"

namespace knuckle::recording {

// What Foxglove draws in 3-D, as messages: entities (foxglove_msgs/SceneEntity) with the primitives that Knuckle uses.
// Plain data whose order is that of the message; lengths in metres, in the entity's frame.

using Colour = std::array<double, 4>;  ///< Red, green, blue, opacity; [0, 1].

struct Pose3 {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  std::array<double, 4> orientation{0, 0, 0, 1};  ///< Quaternion x, y, z, w.

  template <typename Self, typename Visit>
  static void fields(Self& s, Visit&& visit) {
    visit("position", s.position_m);
    visit("orientation", s.orientation);
  }
};
/// Of a frame in the arm's plane, whose x axis is turned by an angle counter-clockwise, seen with x to the right and z
/// up.
[[nodiscard]] Pose3 pose_in_plane(const PlanarVector& at_m, double angle_rad) noexcept;

struct Arrow {
  Pose3 pose;  ///< Of its tail; along x.
  double shaft_m = 0, shaft_diameter_m = 0, head_m = 0, head_diameter_m = 0;
  Colour colour{};

  template <typename Self, typename Visit>
  static void fields(Self& s, Visit&& visit) {
    visit("pose", s.pose);
    visit("shaft_length", s.shaft_m);
    visit("shaft_diameter", s.shaft_diameter_m);
    visit("head_length", s.head_m);
    visit("head_diameter", s.head_diameter_m);
    visit("color", s.colour);
  }
};

/// A box or an ellipsoid.
struct Solid {
  Pose3 pose;  ///< Of its centre.
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();
  Colour colour{};

  template <typename Self, typename Visit>
  static void fields(Self& s, Visit&& visit) {
    visit("pose", s.pose);
    visit("size", s.size_m);
    visit("color", s.colour);
  }
};

enum class LineKind : std::uint8_t { kStrip, kLoop, kList };  ///< kList: pairs of points.

struct Line {
  LineKind kind = LineKind::kStrip;
  double thickness_m = 0;
  std::span<const Eigen::Vector3d> points_m;
  Colour colour{};
};

/// Faces the viewer, of the same size from everywhere.
struct Label {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  std::string_view text;
  Colour colour{};
};

struct Entity {
  std::string_view id;     ///< Replaces the one with this id before it, on the same topic.
  std::string_view frame;  ///< It moves with this frame.
  /// A key and its value; none where the key is empty.
  struct Note {
    std::string_view key{}, value{};
  } note{};
  std::span<const Arrow> arrows{};
  std::span<const Solid> boxes{}, ellipsoids{};
  std::span<const Line> lines{};
  std::span<const Label> labels{};
};

void put_deletion(CdrWriter& out, std::int64_t unix_ns, std::string_view id) noexcept;
void put_entity(CdrWriter& out, std::int64_t unix_ns, const Entity& entity) noexcept;

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
