// From where the picture is seen: pure functions from mouse to camera and between pixels and the machine's plane.
// Space as in mesh.h: frame M with y to the left. Pixels count from the viewport's upper left corner, y down.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>

#include "core/joints.h"
#include "machine/description.h"
#include "machine/description_fwd.h"

namespace knuckle::console::picture {

/// The part of the framebuffer that the picture fills.
struct Viewport {
  int left_px = 0, bottom_px = 0;  ///< From the framebuffer's lower left corner, as OpenGL counts.
  int width_px = 1, height_px = 1;
  double line_scale = 1;  ///< Width of lines: the interface's scale.
  bool operator==(const Viewport&) const = default;
};

struct Camera {
  enum class Kind : std::uint8_t { kOrbit, kSide, kMounted };
  Kind kind = Kind::kSide;
  double reach_m = 1;  ///< Of the machine: what distances are limited by.
  // Orbit.
  double yaw_rad = 0;    ///< 0: from the machine's right; positive: from further ahead.
  double pitch_rad = 0;  ///< Above the horizon.
  double distance_m = 1;
  Eigen::Vector3d target_m = Eigen::Vector3d::Zero();
  // Side.
  Eigen::AlignedBox2d shown_m;  ///< At least this of the machine's plane is seen.
  // Mounted on the machine: place, direction and lens as in its file.
  CameraDescription mount;
};

/// Everything that hull and bucket can reach in their working ranges, frame M.
[[nodiscard]] Eigen::AlignedBox2d reach_box(const MachineDescription& machine);

/// From the right, without perspective, the whole reach visible.
[[nodiscard]] Camera side_camera(const MachineDescription& machine);
/// From behind on the right, as an operator who stands there sees it.
[[nodiscard]] Camera orbit_camera(const MachineDescription& machine);
/// What a camera on the machine sees; its picture has square pixels and fills the viewport.
[[nodiscard]] Camera mounted_camera(const MachineDescription& machine, const CameraDescription& mount);

// A camera on the machine is moved by none of these.
/// The mouse dragged the machine round: an orbit alone.
[[nodiscard]] Camera turned(Camera camera, const Eigen::Vector2d& drag_px, const Viewport& viewport);
/// The wheel: positive steps come closer. @param about_m of a side view: this point of the plane stays where it is.
[[nodiscard]] Camera zoomed(Camera camera, double steps, const PlanarVector& about_m = PlanarVector::Zero());
/// The mouse dragged what is seen along.
[[nodiscard]] Camera shifted(Camera camera, const Eigen::Vector2d& drag_px, const Viewport& viewport);

/// Columns: to the right, up, and towards the eye, as the camera is turned.
[[nodiscard]] Eigen::Matrix3d facing(const Camera& camera);
/// Column vectors, clip space of OpenGL.
[[nodiscard]] Eigen::Matrix4d view_projection(const Camera& camera, const Viewport& viewport);

/// Lines to measure by in a side view.
struct Grid {
  double step_m = 1;  ///< 1, 2 or 5 times a power of ten of the unit; at least some 64 pixels of the design.
  PlanarVector middle_m = PlanarVector::Zero();  ///< A crossing of two lines near the middle of the picture.
};
/// @param unit_m that lengths are shown in. @param zero_m height from which heights are counted.
[[nodiscard]] Grid grid_of(const Camera& camera, const Viewport& viewport, double unit_m, double zero_m);

/// Where the machine's plane (y = 0) is under a pixel, as (x, z); nullopt where it is not, or beyond anything to be
/// pointed at.
[[nodiscard]] std::optional<PlanarVector> plane_point(const Camera& camera, const Viewport& viewport,
                                                      const Eigen::Vector2d& pixel);
/// nullopt behind the camera.
[[nodiscard]] std::optional<Eigen::Vector2d> pixel_of(const Camera& camera, const Viewport& viewport,
                                                      const Eigen::Vector3d& point_m);

}  // namespace knuckle::console::picture
