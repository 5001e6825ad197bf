// What Foxglove draws in 3-D, as messages: entities (foxglove_msgs/SceneEntity) with the primitives that Knuckle uses.
// Plain data whose order is that of the message; lengths in metres, in the entity's frame.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "core/joints.h"
#include "recording/cdr.h"

namespace knuckle::recording {

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

}  // namespace knuckle::recording
