// Walls, soil and loads told from each other by force and way of the tip.
#include "estimation/contact_compliance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/estimation/test_machine.h"

namespace knuckle::estimation {
namespace {

const PlanarVector kInto(0.6, -0.8);

/// Pressed along kInto: the force is reported through the same poles as it is in the estimator, with its noise.
class Pressed {
 public:
  double step(double way_m, double force_N) {
    const PlanarVector noise(10 * normal_(random_), 10 * normal_(random_));
    share = contact_compliance_.step(way_m * kInto, force_.step(-force_N * kInto + noise));
    return share;
  }
  double share = 0;

 private:
  ContactCompliance contact_compliance_{kStep_s};
  ForceLag<PlanarVector> force_{kStep_s};
  std::mt19937_64 random_{1};
  std::normal_distribution<double> normal_;
};

TEST(ContactCompliance, SoilThatMovesAlongUnderASteadyForceYields) {
  Pressed soil;
  double way = 0;
  for (double t = 0; t < 2; t += kStep_s) soil.step(way += 0.1 * kStep_s, 1000);
  EXPECT_GT(soil.share, 0.95);
}

TEST(ContactCompliance, ALoadThatHangsStillSaysNothingUntilItIsLifted) {
  Pressed load;
  for (double t = 0; t < 3; t += kStep_s) EXPECT_LT(load.step(0, 500), 0.2) << t;
  double way = 0;
  for (double t = 0; t < 0.5; t += kStep_s) load.step(way += 0.05 * kStep_s, 500);
  EXPECT_GT(load.share, 0.8);
}

TEST(ContactCompliance, AWallDoesNotAtAnyStiffnessNorSpeedOfTouch) {
  for (const double wall_N_per_m : {2e5, 1e6, 1e8}) {
    for (const double speed_mps : {0.01, 0.1, 0.3}) {
      Pressed wall;
      double way = -0.5 * speed_mps;  // half a second of free air
      for (double t = 0; t < 3; t += kStep_s) {
        // Beyond the touch the machine presses on, slower and slower, to 4 kN.
        const double depth = std::max(0.0, way);
        const double left = std::max(0.0, 1 - wall_N_per_m * depth / 4000);
        way += speed_mps * (way < 0 ? 1 : std::min(left, 3 * 4000 / wall_N_per_m / speed_mps)) * kStep_s;
        wall.step(way, std::min(wall_N_per_m * depth, 5000.0));
        EXPECT_LT(wall.share, 0.3) << wall_N_per_m << " N/m, " << speed_mps << " m/s, " << t << " s";
      }
      EXPECT_LT(wall.share, 0.1) << wall_N_per_m << " N/m, " << speed_mps << " m/s";
    }
  }
}

TEST(ContactCompliance, HammeringOnAWallIsNoSoil) {
  Pressed wall;
  for (double t = 0; t < 5; t += kStep_s) {
    const double way = 0.02 * std::sin(2 * 3.14159 * 1.5 * t);
    wall.step(way, 1e6 * std::max(0.0, way - 0.017));
    EXPECT_LT(wall.share, 0.3) << t;
  }
}

TEST(ContactCompliance, FreeAirIsNoContactAndForgetsTheLastOne) {
  Pressed tip;
  double way = 0;
  for (double t = 0; t < 1; t += kStep_s) EXPECT_EQ(tip.step(way += 0.3 * kStep_s, 60), 0);
  for (double t = 0; t < 1; t += kStep_s) tip.step(way += 0.1 * kStep_s, 1000);
  EXPECT_GT(tip.share, 0.8);
  for (double t = 0; t < 1; t += kStep_s) tip.step(way, 0);
  for (double t = 0; t < 0.5; t += kStep_s) EXPECT_LT(tip.step(way, 1000), 0.1);
}

}  // namespace
}  // namespace knuckle::estimation
