// A camera's place from clicks on the bucket's tip: found again, with what remains; refused where it cannot be known.
#include "estimation/identification/camera_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "tests/support/says.h"

namespace knuckle::estimation {
namespace {

constexpr int kWidth = 1280, kHeight = 720;
constexpr double kReach_m = 3.2;

CameraDescription mast() {
  CameraDescription c;
  c.name = "mast";
  c.position_m = {-0.35, 0.55, 1.45};
  c.pan_rad = -0.17;
  c.tilt_rad = -0.45;
  c.field_of_view_rad = 1.31;
  return c;
}
/// As a file that was written for another mounting.
CameraDescription wrong() {
  CameraDescription c = mast();
  c.position_m += Eigen::Vector3d(0.3, -0.2, 0.25);
  c.pan_rad += 0.25;
  c.tilt_rad -= 0.2;
  c.field_of_view_rad = 1.0;
  return c;
}

/// Independent of the fit: by rotations, not by its formula.
Eigen::Vector2d seen(const CameraDescription& c, const PlanarVector& tip_m) {
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(c.pan_rad, Eigen::Vector3d::UnitZ()) *
                                Eigen::AngleAxisd(-c.tilt_rad, Eigen::Vector3d::UnitY()))
                                   .toRotationMatrix();
  const Eigen::Vector3d p = turn.transpose() * (Eigen::Vector3d(tip_m.x(), 0, tip_m.y()) - c.position_m);
  const double focal = 0.5 * kWidth / std::tan(c.field_of_view_rad / 2);
  return {0.5 * kWidth - focal * p.y() / p.x(), 0.5 * kHeight - focal * p.z() / p.x()};
}

std::vector<TipSight> clicks(const std::vector<PlanarVector>& tips, double error_px, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> error(0, 1);
  std::vector<TipSight> sights;
  for (const PlanarVector& tip : tips)
    sights.push_back({tip, seen(mast(), tip) + error_px * Eigen::Vector2d(error(random), error(random))});
  return sights;
}
std::vector<PlanarVector> spread() {
  return {{1.2, -0.5}, {2.6, -0.4}, {2.4, 0.8}, {1.5, 0.3}, {3.0, 0.2}, {1.9, -0.7}, {2.0, 0.5}, {2.8, -0.6}};
}

TEST(CameraFit, FindsACameraAgainFromClicksWithoutError) {
  const CameraFit fit = fit_camera(clicks(spread(), 0), wrong(), kWidth, kHeight, kReach_m);
  EXPECT_EQ(fit.refused, "");
  EXPECT_LT(fit.rms_px, 1e-3);
  EXPECT_LT((fit.camera.position_m - mast().position_m).norm(), 1e-4);
  EXPECT_NEAR(fit.camera.pan_rad, mast().pan_rad, 1e-5);
  EXPECT_NEAR(fit.camera.tilt_rad, mast().tilt_rad, 1e-5);
  EXPECT_NEAR(fit.camera.field_of_view_rad, mast().field_of_view_rad, 1e-5);
  EXPECT_EQ(fit.camera.name, "mast");
}

TEST(CameraFit, SaysWhatRemainsOfClicksAsAPersonMakesThem) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const CameraFit fit = fit_camera(clicks(spread(), 2, seed), wrong(), kWidth, kHeight, kReach_m);
    ASSERT_EQ(fit.residual_px.size(), spread().size());
    EXPECT_GT(fit.rms_px, 0.3) << seed;
    EXPECT_LT(fit.rms_px, 5) << seed;
    EXPECT_EQ(fit.refused, "") << seed;
    // Of use also for tips that were not clicked.
    for (const PlanarVector& tip : {PlanarVector(1.7, 0.0), PlanarVector(2.5, 0.4), PlanarVector(2.3, -0.6)})
      EXPECT_LT((seen(fit.camera, tip) - seen(mast(), tip)).norm(), 4 * fit.drawn_sd_px) << seed;
  }
}

TEST(CameraFit, RefusesTooFewPosesOnesAlongALineAndOnesInOnePlace) {
  auto few = clicks(spread(), 0);
  few.resize(kLeastTipSights - 1);
  EXPECT_EQ(fit_camera(few, mast(), kWidth, kHeight, kReach_m).refused, "5 of at least 6 poses");
  std::vector<PlanarVector> line, place;
  const std::vector<PlanarVector> same(8, PlanarVector(2.0, 0.1));
  for (int i = 0; i < 8; ++i) {
    line.push_back({1.5 + 0.15 * i, 0.1 + 0.05 * i});
    place.push_back({2.0 + 0.01 * (i % 3), 0.1 + 0.01 * (i / 3)});
  }
  for (const auto& tips : {line, place, same}) {
    const CameraFit fit = fit_camera(clicks(tips, tips == same ? 0 : 1), mast(), kWidth, kHeight, kReach_m);
    EXPECT_TRUE(test::says(fit.refused, "do not tell where the camera is"));
    EXPECT_FALSE(test::says(fit.refused, "by 1000000000"));
  }
}

TEST(CameraFit, RefusesACameraThatSeesNowhereThatTheTipWorks) {
  CameraDescription up = mast();
  up.pan_rad = -0.2;
  up.tilt_rad = 0.25;
  up.field_of_view_rad = 0.7;
  std::vector<TipSight> sights;
  for (const PlanarVector& tip : std::vector<PlanarVector>{
           {1.6, 1.6}, {2.4, 1.7}, {2.2, 2.3}, {1.5, 2.0}, {2.7, 2.0}, {1.9, 1.8}, {2.0, 2.1}, {2.6, 1.6}})
    sights.push_back({tip, seen(up, tip)});
  const CameraFit fit = fit_camera(sights, up, kWidth, kHeight, kReach_m);
  ASSERT_LT(fit.rms_px, 1e-3);
  EXPECT_TRUE(test::says(fit.refused, "would not see where the tip works"));
}

TEST(CameraFit, LooksAlsoWhereTheTipWasClicked) {
  CameraDescription up = mast();
  up.tilt_rad = 0.25;
  std::vector<TipSight> sights;
  for (int i = 0; i < 8; ++i) {
    const PlanarVector tip(2.0 + 0.02 * (i % 3), 1.9 + 0.02 * (i / 3));
    sights.push_back({tip, seen(up, tip)});
  }
  EXPECT_GT(fit_camera(sights, up, kWidth, kHeight, kReach_m).drawn_sd_px, 0);
}

TEST(CameraFit, BoundsWhatRemainsByThePicturesWidth) {
  // The same clicks in a picture of half the width: the bound is half as many pixels.
  auto sights = clicks(spread(), 0);
  for (std::size_t i = 0; i < sights.size(); ++i) sights[i].pixel.y() += i % 2 == 0 ? 55 : -55;
  const CameraFit whole = fit_camera(sights, mast(), kWidth, kHeight, kReach_m);
  for (TipSight& sight : sights) sight.pixel *= 0.5;
  const CameraFit half = fit_camera(sights, mast(), kWidth / 2, kHeight / 2, kReach_m);
  EXPECT_TRUE(test::says(whole.refused, "(at most 25)"));
  EXPECT_TRUE(test::says(half.refused, "(at most 12)"));
}

TEST(CameraFit, RefusesClicksThatContradictEachOther) {
  auto sights = clicks(spread(), 0);
  std::swap(sights[0].pixel, sights[2].pixel);
  std::swap(sights[3].pixel, sights[4].pixel);
  const CameraFit fit = fit_camera(sights, mast(), kWidth, kHeight, kReach_m);
  EXPECT_TRUE(test::says(fit.refused, "contradict each other"));
}

TEST(CameraFit, IsWrittenAsTheMachinesFileHasIt) {
  const std::string block = camera_block(fit_camera(clicks(spread(), 0), wrong(), kWidth, kHeight, kReach_m));
  EXPECT_NE(block.find("[[camera]]"), std::string::npos);
  EXPECT_NE(block.find("position_m = [-0.350, 0.550, 1.450]"), std::string::npos) << block;
  EXPECT_NE(block.find("field_of_view_deg = 75.06"), std::string::npos) << block;
}

}  // namespace
}  // namespace knuckle::estimation
