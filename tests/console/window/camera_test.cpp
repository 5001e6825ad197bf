// Between pixels and the machine's plane, and what the mouse does to the view.
#include "app/console/picture/camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "machine/kinematics.h"
#include "machine/load.h"
#include "tests/support/solar.h"

namespace knuckle::console::window {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr unsigned kSeed = 21;
const picture::Viewport kWindow{.width_px = 1280, .height_px = 800};

bool inside(const Vector2d& pixel, const picture::Viewport& viewport) {
  return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= viewport.width_px && pixel.y() <= viewport.height_px;
}

void expect_round_trip(const picture::Camera& camera, const picture::Viewport& viewport, const Vector2d& pixel) {
  const auto point = picture::plane_point(camera, viewport, pixel);
  ASSERT_TRUE(point);
  const auto back = picture::pixel_of(camera, viewport, Vector3d(point->x(), 0, point->y()));
  ASSERT_TRUE(back);
  EXPECT_NEAR((*back - pixel).norm(), 0, 1e-6) << "seed " << kSeed;
}

TEST(Camera, APixelOfTheMachinesPlaneIsFoundAgain) {
  std::mt19937 random(kSeed);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const picture::Camera side = picture::side_camera(test::solar()), first = picture::orbit_camera(test::solar());
  for (int run = 0; run < 500; ++run) {
    const picture::Viewport viewport{.width_px = 300 + run, .height_px = 900 - run};
    const Vector2d pixel(uniform(0, viewport.width_px), uniform(0, viewport.height_px));
    expect_round_trip(side, viewport, pixel);
    picture::Camera orbit = first;
    orbit.yaw_rad = uniform(-0.7, 0.7);
    orbit.pitch_rad = uniform(0.1, 0.6);
    expect_round_trip(picture::zoomed(orbit, uniform(-5, 5)), viewport, pixel);
  }
}

TEST(Camera, SideViewShowsForwardRightAndUpUp) {
  const picture::Camera camera = picture::side_camera(test::solar());
  const Vector2d origin = *picture::pixel_of(camera, kWindow, Vector3d::Zero());
  EXPECT_GT(picture::pixel_of(camera, kWindow, Vector3d(1, 0, 0))->x(), origin.x() + 50);
  EXPECT_LT(picture::pixel_of(camera, kWindow, Vector3d(0, 0, 1))->y(), origin.y() - 50);
  EXPECT_NEAR((*picture::pixel_of(camera, kWindow, Vector3d(0, 5, 0)) - origin).norm(), 0, 1e-9) << "no perspective";
}

TEST(Camera, SideViewHoldsTheWholeReachInWindowsOfAnyShape) {
  const MachineDescription m = test::solar();
  const picture::Camera camera = picture::side_camera(m);
  const LinkDescription *boom = &m.links[kBoom], *arm = &m.links[kArm], *bucket = &m.links[kBucket];
  for (const picture::Viewport& viewport : {kWindow, picture::Viewport{.width_px = 400, .height_px = 900},
                                            picture::Viewport{.width_px = 2000, .height_px = 300}})
    for (double q1 : {boom->min_rad, 0.3, boom->max_rad})
      for (double q2 : {arm->min_rad, -1.5, arm->max_rad})
        for (double q3 : {bucket->min_rad, -1.0, bucket->max_rad}) {
          const PlanarVector tip = pose_of(m, {q1, q2, q3}).tip_m;
          EXPECT_TRUE(inside(*picture::pixel_of(camera, viewport, Vector3d(tip.x(), 0, tip.y())), viewport))
              << tip.transpose();
        }
}

TEST(Camera, OrbitFirstShowsTheMachineAndWhereItWorks) {
  const MachineDescription m = test::solar();
  const picture::Camera camera = picture::orbit_camera(m);
  for (const Vector3d& point :
       {Vector3d(-1.6, -0.5, -0.8), Vector3d(-1.6, 0.5, 1.3), Vector3d(2.8, 0, 0.5), Vector3d(2.3, -1, -0.8)})
    EXPECT_TRUE(inside(*picture::pixel_of(camera, kWindow, point), kWindow)) << point.transpose();
}

TEST(Camera, AnOrbitStaysAboveTheGroundAndInSightHoweverTheMouseIsMoved) {
  const MachineDescription m = test::solar();
  picture::Camera camera = picture::orbit_camera(m);
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> drag(-2000, 2000);
  for (int run = 0; run < 1000; ++run) {
    camera = picture::turned(camera, {drag(random), drag(random)}, kWindow);
    camera = picture::shifted(camera, {drag(random), drag(random)}, kWindow);
    camera = picture::zoomed(camera, drag(random) / 100);
    EXPECT_GT(camera.pitch_rad, 0);
    EXPECT_LT(camera.pitch_rad, 1.5);
    EXPECT_LE(std::abs(camera.yaw_rad), 3.15);
    EXPECT_LE(camera.target_m.cwiseAbs().maxCoeff(), reach_m(m));
    EXPECT_GE(camera.distance_m, 0.4 * reach_m(m));
    EXPECT_LE(camera.distance_m, 7 * reach_m(m));
    EXPECT_TRUE(picture::view_projection(camera, kWindow).allFinite());
  }
}

TEST(Camera, TheMouseTakesWhatItHoldsAlong) {
  const picture::Camera camera = picture::orbit_camera(test::solar());
  const Vector3d front(0.7, -0.5, 0);  // near the target, on the camera's side
  const Vector2d before = *picture::pixel_of(camera, kWindow, front);
  EXPECT_GT(picture::pixel_of(picture::turned(camera, {40, 0}, kWindow), kWindow, front)->x(), before.x());
  const Vector2d target = *picture::pixel_of(camera, kWindow, camera.target_m);
  const Vector2d moved = *picture::pixel_of(picture::shifted(camera, {30, 20}, kWindow), kWindow, camera.target_m);
  EXPECT_NEAR((moved - target - Vector2d(30, 20)).norm(), 0, 2);
  EXPECT_LT(picture::zoomed(camera, 1).distance_m, camera.distance_m);
}

TEST(Camera, ASideViewIsTurnedAndAMountedOneMovedByNoMouse) {
  const picture::Camera side = picture::side_camera(test::solar());
  EXPECT_EQ(picture::view_projection(side, kWindow),
            picture::view_projection(picture::turned(side, {50, 50}, kWindow), kWindow));
  const picture::Camera mounted = picture::mounted_camera(test::solar(), test::solar().cameras.at(0));
  for (const picture::Camera& c :
       {picture::turned(mounted, {90, 40}, kWindow), zoomed(mounted, 3), shifted(mounted, {90, 40}, kWindow)})
    EXPECT_EQ(view_projection(c, kWindow), view_projection(mounted, kWindow));
}

TEST(Camera, ASideViewComesCloserToThePointUnderTheMouseAndIsDraggedAlong) {
  const picture::Camera camera = picture::side_camera(test::solar());
  const Vector3d tip(2.4, 0, -0.3), beside = tip + Vector3d(0.1, 0, 0);
  const Vector2d before = *picture::pixel_of(camera, kWindow, tip);
  const picture::Camera close = picture::zoomed(camera, 6, {tip.x(), tip.z()});
  EXPECT_NEAR((*picture::pixel_of(close, kWindow, tip) - before).norm(), 0, 1e-6) << "stays under the mouse";
  const auto apart = [&](const picture::Camera& c) {
    return (*picture::pixel_of(c, kWindow, beside) - *picture::pixel_of(c, kWindow, tip)).norm();
  };
  EXPECT_NEAR(apart(close) / apart(camera), std::pow(0.9, -6), 1e-6);
  const Vector2d moved = *picture::pixel_of(picture::shifted(close, {30, 20}, kWindow), kWindow, tip);
  EXPECT_NEAR((moved - before - Vector2d(30, 20)).norm(), 0, 1e-6);
}

TEST(Camera, ASideViewKeepsTheMachineInReachHoweverTheMouseIsMoved) {
  const MachineDescription m = test::solar();
  picture::Camera camera = picture::side_camera(m);
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> drag(-2000, 2000);
  for (int run = 0; run < 1000; ++run) {
    camera = picture::shifted(camera, {drag(random), drag(random)}, kWindow);
    camera = picture::zoomed(camera, drag(random) / 100, {drag(random) / 500, drag(random) / 500});
    EXPECT_LE(camera.shown_m.center().cwiseAbs().maxCoeff(), 1.31 * reach_m(m));
    EXPECT_GE(camera.shown_m.sizes().maxCoeff(), 0.05 * reach_m(m));
    EXPECT_LE(camera.shown_m.sizes().maxCoeff(), 3.1 * reach_m(m));
  }
}

TEST(Grid, HasRoundStepsThatAreFarEnoughApartToBeReadInEitherUnit) {
  picture::Camera camera = picture::side_camera(test::solar());
  for (const double unit_m : {1.0, 0.3048})
    for (int steps = -8; steps < 24; steps += 3) {
      const picture::Camera seen = picture::zoomed(camera, steps, {2, 0});
      const picture::Grid grid = picture::grid_of(seen, kWindow, unit_m, -0.37);
      const double step = grid.step_m / unit_m, digit = step / std::pow(10, std::floor(std::log10(step) + 1e-9));
      EXPECT_LT(std::min({std::abs(digit - 1), std::abs(digit - 2), std::abs(digit - 5)}), 1e-6) << digit;
      const Vector2d a = *picture::pixel_of(seen, kWindow, {0, 0, 0});
      const double apart_px = picture::pixel_of(seen, kWindow, {grid.step_m, 0, 0})->x() - a.x();
      EXPECT_GE(apart_px, 63.9);
      EXPECT_LE(apart_px, 64 * 2.6);
      const double lines = (grid.middle_m.y() + 0.37) / grid.step_m;
      EXPECT_NEAR(lines, std::round(lines), 1e-6) << "one line is at the height that is counted from";
    }
}

TEST(Camera, NoPointOfThePlaneIsUnderAPixelOfTheSky) {
  picture::Camera camera = picture::orbit_camera(test::solar());
  camera.yaw_rad = -1.2;
  EXPECT_FALSE(picture::plane_point(camera, kWindow, {1279, 400})) << "looks past the plane";
  EXPECT_FALSE(picture::pixel_of(camera, kWindow, Vector3d(-100, 0, 0))) << "behind the camera";
}

/// The pinhole camera as textbooks have it, without any matrix.
TEST(Camera, AMountedOneSeesAsAPinholeDoesAndFindsAPixelAgain) {
  CameraDescription mount;
  mount.position_m = {-0.35, 0.55, 1.45};
  mount.pan_rad = -0.2;
  mount.tilt_rad = -0.45;
  mount.field_of_view_rad = 1.3;
  const picture::Viewport port{.width_px = 1280, .height_px = 720};
  const picture::Camera camera = picture::mounted_camera(test::solar(), mount);
  for (const Eigen::Vector3d& point :
       {Eigen::Vector3d(2.6, 0, 0.4), {3.0, 0.5, -0.8}, {1.5, -0.6, 0.9}, {3, 0, -0.7}}) {
    const Eigen::Vector3d to = point - mount.position_m;
    const double c = std::cos(mount.pan_rad), s = std::sin(mount.pan_rad);
    const double ahead = c * to.x() + s * to.y(), left = -s * to.x() + c * to.y();
    const double depth = std::cos(mount.tilt_rad) * ahead + std::sin(mount.tilt_rad) * to.z();
    const double up = -std::sin(mount.tilt_rad) * ahead + std::cos(mount.tilt_rad) * to.z();
    const double focal_px = 640 / std::tan(0.65);
    const auto pixel = pixel_of(camera, port, point);
    ASSERT_TRUE(pixel);
    EXPECT_NEAR(pixel->x(), 640 - focal_px * left / depth, 1e-6);
    EXPECT_NEAR(pixel->y(), 360 - focal_px * up / depth, 1e-6);
    if (point.y() == 0) {
      EXPECT_LT((plane_point(camera, port, *pixel).value() - PlanarVector(point.x(), point.z())).norm(), 1e-9);
    }
  }
  EXPECT_FALSE(pixel_of(camera, port, {-2, 0.55, 1}));
}

}  // namespace
}  // namespace knuckle::console::window
