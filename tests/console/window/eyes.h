// Eyes for tests: where the bucket is, from a camera's picture alone, by the two target balls on it; and what has
// changed on the ground. They know what an operator knows: where the camera stands on the machine, and how the machine
// is built.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "app/console/picture/machine_mesh.h"
#include "app/console/picture/picture_colours.h"
#include "app/console/picture/world_mesh.h"
#include "machine/description.h"
#include "machine/kinematics.h"
#include "video/frame.h"

namespace knuckle::test {

struct SeenBucket {
  PlanarVector tip_m = PlanarVector::Zero();
  double angle_rad = 0;   ///< To the machine's x axis.
  double foremost_m = 0;  ///< How far forward any part of it reaches: curled in, its heel goes before its tip.
  JointVector joint_rad = JointVector::Zero();
};

class Eyes {
 public:
  Eyes(const MachineDescription& machine, const CameraDescription& mount)
      : machine_(machine), mount_(mount), kinematics_(machine), balls_(console::picture::target_balls(machine)) {
    const double c = std::cos(mount.tilt_rad);
    ahead_ = {c * std::cos(mount.pan_rad), c * std::sin(mount.pan_rad), std::sin(mount.tilt_rad)};
    right_ = ahead_.cross(Eigen::Vector3d::UnitZ()).normalized();
    up_ = right_.cross(ahead_);
  }

  /// nullopt where a ball is hidden.
  [[nodiscard]] std::optional<SeenBucket> bucket(const video::Frame& frame) const {
    const auto near_pin = ball(frame, 0), near_teeth = ball(frame, 1);
    if (!near_pin || !near_teeth) return std::nullopt;
    const auto flat = [](const Eigen::Vector3d& p) { return PlanarVector(p.x(), p.z()); };
    const PlanarVector a(balls_.at_m[0].x(), balls_.at_m[0].z()), b(balls_.at_m[1].x(), balls_.at_m[1].z());
    const PlanarVector seen = flat(*near_teeth) - flat(*near_pin), built = b - a;
    SeenBucket bucket;
    bucket.angle_rad = std::atan2(seen.y(), seen.x()) - std::atan2(built.y(), built.x());
    bucket.angle_rad = std::remainder(bucket.angle_rad, 2 * M_PI);
    if (bucket.angle_rad > kMostAngle_rad) bucket.angle_rad -= 2 * M_PI;
    const Eigen::Rotation2Dd turn(bucket.angle_rad);
    const PlanarVector middle = 0.5 * (flat(*near_pin) + flat(*near_teeth));
    bucket.tip_m = middle + turn * (PlanarVector(machine_.links[kBucket].length_m, 0) - 0.5 * (a + b));
    bucket.foremost_m = foremost_m(bucket.tip_m, turn);
    const auto joints = kinematics_.inverse(bucket.tip_m, bucket.angle_rad);
    if (!joints) return std::nullopt;
    bucket.joint_rad = *joints;
    return bucket;
  }

  /// Where something lies before the machine that was not there in the picture before, and how large it looks.
  struct NewThing {
    PlanarVector centre_m = PlanarVector::Zero();
    double radius_m = 0;
    int pixels = 0;
  };
  /// @param ground_m where the tracks stand.
  [[nodiscard]] std::optional<NewThing> new_on_ground(const video::Frame& before, const video::Frame& now,
                                                      double ground_m, double from_m, double to_m) const {
    Eigen::AlignedBox2d box;
    int pixels = 0;
    for (int v = 0; v < now.height_px; v += 2)
      for (int u = 0; u < now.width_px; u += 2) {
        const auto on_ground = at_height(u, v, ground_m);
        if (!on_ground || on_ground->x() < from_m || on_ground->x() > to_m || std::abs(on_ground->y()) > kBeside_m)
          continue;
        if (difference(before, now, u, v) < kOther) continue;
        ++pixels;
        box.extend(Eigen::Vector2d(u, v));
      }
    if (pixels < kLeastPixels) return std::nullopt;
    const Eigen::Vector2d centre = box.center();
    NewThing thing;
    thing.pixels = pixels;
    const auto foot = at_height(centre.x(), centre.y(), ground_m);
    const double away_m = (*foot - mount_.position_m).norm();
    thing.radius_m = 0.5 * box.sizes().x() * away_m / focal_px(now);
    const auto middle = at_height(centre.x(), centre.y(), ground_m + thing.radius_m);
    thing.centre_m = {middle->x(), middle->z()};
    return thing;
  }

 private:
  static constexpr double kMostAngle_rad = 0.9;  // a bucket bent back beyond this is one curled the other way
  static constexpr double kBeside_m = 0.3;       // of the arm's plane
  static constexpr int kOther = 24, kLeastPixels = 60, kLeastBall = 12;

  /// Of the bucket's outline, as the machine's file has it.
  [[nodiscard]] double foremost_m(const PlanarVector& tip_m, const Eigen::Rotation2Dd& turn) const {
    const PlanarVector tip(machine_.links[kBucket].length_m, 0);
    const BucketProfile& profile = machine_.bucket_profile;
    double foremost = tip_m.x();
    for (const PlanarVector& corner : {profile.edge_m, profile.heel_m, profile.back_m, profile.cheek_m})
      foremost = std::max(foremost, (tip_m + turn * (corner - tip)).x());
    return foremost;
  }
  static double focal_of(int width_px, double field_rad) { return 0.5 * width_px / std::tan(field_rad / 2); }
  [[nodiscard]] double focal_px(const video::Frame& frame) const {
    return focal_of(frame.width_px, mount_.field_of_view_rad);
  }
  [[nodiscard]] Eigen::Vector3d ray(double u, double v, int width, int height) const {
    const double f = focal_of(width, mount_.field_of_view_rad);
    return ahead_ + (u + 0.5 - 0.5 * width) / f * right_ - (v + 0.5 - 0.5 * height) / f * up_;
  }
  [[nodiscard]] std::optional<Eigen::Vector3d> at_height(double u, double v, double z_m) const {
    const Eigen::Vector3d r = ray(u, v, width_, height_);
    const double along = (z_m - mount_.position_m.z()) / r.z();
    if (!(along > 0)) return std::nullopt;
    return mount_.position_m + along * r;
  }
  static const std::uint8_t* at(const video::Frame& frame, int u, int v) {
    return frame.pixels + std::ptrdiff_t{v} * frame.row_bytes + std::ptrdiff_t{4} * u;
  }
  static int difference(const video::Frame& a, const video::Frame& b, int u, int v) {
    int most = 0;
    for (int c = 0; c < 3; ++c) most = std::max(most, std::abs(at(a, u, v)[c] - at(b, u, v)[c]));
    return most;
  }
  /// Magenta, green: nothing else in the picture is as colourful.
  static bool is_ball(const std::uint8_t* p, int which) {
    const int r = p[0], g = p[1], b = p[2];
    return which == 0 ? std::min(r, b) - g > 70 : g - std::max(r, b) > 60;
  }
  /// Of its middle, on the plane that it moves in.
  [[nodiscard]] std::optional<Eigen::Vector3d> ball(const video::Frame& frame, int which) const {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    int count = 0;
    for (int v = 0; v < frame.height_px; ++v)
      for (int u = 0; u < frame.width_px; ++u)
        if (is_ball(at(frame, u, v), which)) {
          sum += Eigen::Vector2d(u, v);
          ++count;
        }
    if (count < kLeastBall) return std::nullopt;
    const Eigen::Vector2d middle = sum / count;
    const Eigen::Vector3d r = ray(middle.x(), middle.y(), frame.width_px, frame.height_px);
    const double y = balls_.at_m[static_cast<std::size_t>(which)].y();
    const double along = (y - mount_.position_m.y()) / r.y();
    if (!(along > 0)) return std::nullopt;
    return Eigen::Vector3d(mount_.position_m + along * r);
  }

  const MachineDescription machine_;
  const CameraDescription mount_;
  const Kinematics kinematics_;
  const console::picture::TargetBalls balls_;
  Eigen::Vector3d ahead_, right_, up_;
  static constexpr int width_ = 1280, height_ = 720;
};

}  // namespace knuckle::test
