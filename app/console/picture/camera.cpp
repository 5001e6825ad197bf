#include "app/console/picture/camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/console/widgets/units.h"
#include "machine/kinematics.h"

namespace knuckle::console::picture {
namespace {

using Eigen::Matrix4d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFieldOfView_rad = 0.6;  // vertical
constexpr double kLowest_rad = 0.03, kHighest_rad = 1.45;
constexpr double kNearest = 0.5, kFarthest = 6;   // times reach
constexpr double kSmallest = 0.06, kLargest = 3;  // likewise: what a side view shows across

/// From the target to the eye.
Vector3d eye_direction(const Camera& camera) {
  const double c = std::cos(camera.pitch_rad);
  return {std::sin(camera.yaw_rad) * c, -std::cos(camera.yaw_rad) * c, std::sin(camera.pitch_rad)};
}

/// Against the direction in which a mounted camera looks.
Vector3d mounted_back(const CameraDescription& mount) {
  const double c = std::cos(mount.tilt_rad);
  return -Vector3d(c * std::cos(mount.pan_rad), c * std::sin(mount.pan_rad), std::sin(mount.tilt_rad));
}

struct Axes {
  Vector3d right, up, back;
};
Axes axes(const Camera& camera) {
  if (camera.kind == Camera::Kind::kSide) return {Vector3d::UnitX(), Vector3d::UnitZ(), -Vector3d::UnitY()};
  const Vector3d back = camera.kind == Camera::Kind::kOrbit ? eye_direction(camera) : mounted_back(camera.mount);
  const Vector3d right = Vector3d::UnitZ().cross(back).normalized();
  return {right, back.cross(right), back};
}

Matrix4d look_from(const Vector3d& eye, const Axes& a) {
  Matrix4d view = Matrix4d::Identity();
  view.block<1, 3>(0, 0) = a.right.transpose();
  view.block<1, 3>(1, 0) = a.up.transpose();
  view.block<1, 3>(2, 0) = a.back.transpose();
  view.block<3, 1>(0, 3) = -view.block<3, 3>(0, 0) * eye;
  return view;
}

double aspect(const Viewport& viewport) {
  return static_cast<double>(viewport.width_px) / viewport.height_px;
}

/// Of a camera with perspective.
Vector3d eye_of(const Camera& camera, const Axes& a) {
  return camera.kind == Camera::Kind::kMounted ? camera.mount.position_m
                                               : Vector3d(camera.target_m + camera.distance_m * a.back);
}
/// Tangent of half its vertical field of view.
double half_height(const Camera& camera, double aspect_ratio) {
  return camera.kind == Camera::Kind::kMounted ? std::tan(camera.mount.field_of_view_rad / 2) / aspect_ratio
                                               : std::tan(kFieldOfView_rad / 2);
}

Matrix4d perspective(double half_height, double aspect_ratio, double near_m, double far_m) {
  const double f = 1 / half_height;
  Matrix4d m = Matrix4d::Zero();
  m(0, 0) = f / aspect_ratio;
  m(1, 1) = f;
  m(2, 2) = (near_m + far_m) / (near_m - far_m);
  m(2, 3) = 2 * near_m * far_m / (near_m - far_m);
  m(3, 2) = -1;
  return m;
}

/// Half of what is seen of the machine's plane: the box, and more of it to one side as the window is shaped.
Vector2d half_shown(const Camera& camera, const Viewport& viewport) {
  const Vector2d half = camera.shown_m.sizes() / 2;
  const double height = std::max(half.y(), half.x() / aspect(viewport));
  return {height * aspect(viewport), height};
}

Matrix4d side_projection(const Camera& camera, const Viewport& viewport) {
  const Vector2d half = half_shown(camera, viewport);
  Matrix4d m = Matrix4d::Identity();
  m(0, 0) = 1 / half.x();
  m(1, 1) = 1 / half.y();
  m(2, 2) = -1 / (4 * camera.reach_m);  // of the view's z, which points to the eye
  return m;
}

/// So that the machine cannot be lost: the box moved until its middle is one that the bucket reaches, or nearly.
Eigen::AlignedBox2d within_reach(Eigen::AlignedBox2d box, double reach_m) {
  const Vector2d centre = box.center(), limit = Vector2d::Constant(1.3 * reach_m);
  return box.translate(centre.cwiseMax(-limit).cwiseMin(limit) - centre);
}

/// -1..1 across the viewport, y up.
Vector2d normalised(const Vector2d& pixel, const Viewport& viewport) {
  return {2 * pixel.x() / viewport.width_px - 1, 1 - 2 * pixel.y() / viewport.height_px};
}

}  // namespace

Eigen::AlignedBox2d reach_box(const MachineDescription& machine) {
  constexpr int kSteps = 12;
  const double reach = reach_m(machine);
  Eigen::AlignedBox2d box(PlanarVector(-0.58 * reach, -0.30 * reach), PlanarVector(0.2 * reach, 0.5 * reach));
  const auto angle = [&](std::size_t joint, int step) {
    const LinkDescription& link = machine.links[joint];
    return link.min_rad + (link.max_rad - link.min_rad) * step / kSteps;
  };
  for (int boom = 0; boom <= kSteps; ++boom)
    for (int arm = 0; arm <= kSteps; ++arm)
      for (int bucket = 0; bucket <= kSteps; ++bucket) {
        const MachinePose pose = pose_of(machine, {angle(kBoom, boom), angle(kArm, arm), angle(kBucket, bucket)});
        for (const PlanarVector& p : {pose.tip_m, pose.cylinders[kArm].base_m, pose.cylinders[kBucket].base_m})
          box.extend(p);
      }
  return box;
}

Camera side_camera(const MachineDescription& machine) {
  Camera camera;
  camera.kind = Camera::Kind::kSide;
  camera.reach_m = reach_m(machine);
  camera.shown_m = reach_box(machine);
  const Vector2d margin = Vector2d::Constant(0.03 * camera.reach_m);
  camera.shown_m =
      Eigen::AlignedBox2d(Vector2d(camera.shown_m.min() - margin), Vector2d(camera.shown_m.max() + margin));
  return camera;
}

Camera orbit_camera(const MachineDescription& machine) {
  Camera camera;
  camera.kind = Camera::Kind::kOrbit;
  camera.reach_m = reach_m(machine);
  camera.yaw_rad = -0.65;
  camera.pitch_rad = 0.32;
  camera.distance_m = 2.7 * camera.reach_m;
  camera.target_m = Vector3d(0.22, 0, -0.02) * camera.reach_m;
  return camera;
}

Camera mounted_camera(const MachineDescription& machine, const CameraDescription& mount) {
  Camera camera;
  camera.kind = Camera::Kind::kMounted;
  camera.reach_m = reach_m(machine);
  camera.mount = mount;
  return camera;
}

Camera turned(Camera camera, const Vector2d& drag_px, const Viewport& viewport) {
  if (camera.kind != Camera::Kind::kOrbit) return camera;
  const double rad_per_px = std::numbers::pi / viewport.height_px;
  camera.yaw_rad = std::remainder(camera.yaw_rad - drag_px.x() * rad_per_px, 2 * std::numbers::pi);
  camera.pitch_rad = std::clamp(camera.pitch_rad + drag_px.y() * rad_per_px, kLowest_rad, kHighest_rad);
  return camera;
}

Camera zoomed(Camera camera, double steps, const PlanarVector& about_m) {
  const double factor = std::pow(0.9, steps);
  if (camera.kind == Camera::Kind::kOrbit)
    camera.distance_m = std::clamp(camera.distance_m * factor, kNearest * camera.reach_m, kFarthest * camera.reach_m);
  if (camera.kind == Camera::Kind::kSide) {
    const double across = camera.shown_m.sizes().maxCoeff();
    const double by = std::clamp(across * factor, kSmallest * camera.reach_m, kLargest * camera.reach_m) / across;
    camera.shown_m = within_reach(Eigen::AlignedBox2d(Vector2d(about_m + by * (camera.shown_m.min() - about_m)),
                                                      Vector2d(about_m + by * (camera.shown_m.max() - about_m))),
                                  camera.reach_m);
  }
  return camera;
}

Camera shifted(Camera camera, const Vector2d& drag_px, const Viewport& viewport) {
  if (camera.kind == Camera::Kind::kSide) {
    const double m_per_px = 2 * half_shown(camera, viewport).y() / viewport.height_px;
    camera.shown_m.translate(m_per_px * Vector2d(-drag_px.x(), drag_px.y()));
    camera.shown_m = within_reach(camera.shown_m, camera.reach_m);
  }
  if (camera.kind != Camera::Kind::kOrbit) return camera;
  const double m_per_px = 2 * camera.distance_m * std::tan(kFieldOfView_rad / 2) / viewport.height_px;
  const Axes a = axes(camera);
  const Vector3d reach = Vector3d::Constant(camera.reach_m);
  camera.target_m += m_per_px * (drag_px.y() * a.up - drag_px.x() * a.right);
  camera.target_m = camera.target_m.cwiseMax(-reach).cwiseMin(reach);
  return camera;
}

Eigen::Matrix3d facing(const Camera& camera) {
  const Axes a = axes(camera);
  Eigen::Matrix3d columns;
  columns << a.right, a.up, a.back;
  return columns;
}

Matrix4d view_projection(const Camera& camera, const Viewport& viewport) {
  const Axes a = axes(camera);
  if (camera.kind == Camera::Kind::kSide) {
    const Vector2d centre = camera.shown_m.center();
    return side_projection(camera, viewport) * look_from({centre.x(), 0, centre.y()}, a);
  }
  const double ratio = aspect(viewport), half = half_height(camera, ratio);
  if (camera.kind == Camera::Kind::kMounted)
    return perspective(half, ratio, 0.02 * camera.reach_m, 12 * camera.reach_m) * look_from(eye_of(camera, a), a);
  return perspective(half, ratio, 0.05 * camera.distance_m, camera.distance_m + 6 * camera.reach_m) *
         look_from(eye_of(camera, a), a);
}

Grid grid_of(const Camera& camera, const Viewport& viewport, double unit_m, double zero_m) {
  constexpr double kLeast_px = 64;
  const double m_per_px = 2 * half_shown(camera, viewport).y() / viewport.height_px;
  const double step = round_above(kLeast_px * viewport.line_scale * m_per_px / unit_m);
  const PlanarVector centre = camera.shown_m.center();
  const double step_m = step * unit_m;
  return {step_m,
          {step_m * std::round(centre.x() / step_m), zero_m + step_m * std::round((centre.y() - zero_m) / step_m)}};
}

std::optional<PlanarVector> plane_point(const Camera& camera, const Viewport& viewport, const Vector2d& pixel) {
  const Vector2d at = normalised(pixel, viewport);
  if (camera.kind == Camera::Kind::kSide)
    return PlanarVector(camera.shown_m.center() + at.cwiseProduct(half_shown(camera, viewport)));
  const Axes a = axes(camera);
  const double half = half_height(camera, aspect(viewport));
  const Vector3d eye = eye_of(camera, a);
  const Vector3d ray = at.x() * half * aspect(viewport) * a.right + at.y() * half * a.up - a.back;
  const double along = -eye.y() / ray.y();
  if (!(along > 0) || along > 4 * kFarthest * camera.reach_m) return std::nullopt;
  const Vector3d hit = eye + along * ray;
  return PlanarVector(hit.x(), hit.z());
}

std::optional<Vector2d> pixel_of(const Camera& camera, const Viewport& viewport, const Vector3d& point_m) {
  const Eigen::Vector4d clip = view_projection(camera, viewport) * point_m.homogeneous();
  if (clip.w() <= 0) return std::nullopt;
  return Vector2d((clip.x() / clip.w() + 1) / 2 * viewport.width_px,
                  (1 - clip.y() / clip.w()) / 2 * viewport.height_px);
}

}  // namespace knuckle::console::picture
