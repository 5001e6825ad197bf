// Friction's bristles behind encoders with steps, in free air and where the world holds the bucket.
#include "estimation/observer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "estimation/force_estimator.h"
#include "tests/estimation/test_machine.h"

namespace knuckle::estimation {
namespace {

constexpr double kLever_m = 0.3, kEncoderStep_m = 1e-4;

/// Rods of three joints alike, bent one way by two millimetres of extension, and standing.
class Rods {
 public:
  explicit Rods(const ChannelBand& band = kSlowBand) : channel_(band, kStep_s, JointVector::Constant(kEncoderStep_m)) {
    for (int k = 0; k < 20; ++k) move(1e-4, 0, false);
    for (int k = 0; k < 100; ++k) move(0, 0, true);
  }
  /// @return what the first rod's bristles are bent by, of 1.
  double move(double extension_m, double vibration_mps, bool held) {
    channel_.move(JointVector::Constant(extension_m / kLever_m), JointVector::Constant(kLever_m),
                  JointVector::Constant(vibration_mps), held);
    return channel_.bristle[0];
  }
  [[nodiscard]] double bristle() const { return channel_.bristle[0]; }

 private:
  ObserverChannel channel_;
};

TEST(Observer, BristlesOfARodThatStandsStayBentWhereTheWorldHoldsIt) {
  Rods rods;
  for (int k = 0; k < 1000; ++k) rods.move(0, 0, true);
  EXPECT_GT(rods.bristle(), 0.95);
  for (int k = 0; k < 1000; ++k) rods.move(0, 0, false);
  EXPECT_LT(rods.bristle(), 0.05);
}

TEST(Observer, AVibrationReleasesThemByItsWay) {
  Rods rods;
  const double bent = rods.bristle();
  for (int k = 0; k < 200; ++k) rods.move(0, 1e-4, true);
  EXPECT_NEAR(rods.bristle(), bent * std::exp(-1), 0.01);
}

TEST(Observer, NoVibrationReleasesThoseOfARodThatGoesOneWay) {
  Rods rods;
  for (int k = 0; k < 400; ++k) rods.move(2e-2 * kStep_s, 1e-2, true);
  EXPECT_GT(rods.bristle(), 0.95);
}

// 1 mm/s, which the encoder shows as a step every 0.1 s.
TEST(Observer, NoVibrationReleasesThoseOfARodThatCreepsFaster) {
  for (const ChannelBand& band : {kSlowBand, kFastBand}) {
    Rods rods(band);
    double sum = 0;
    for (int k = 0; k < 400; ++k) sum += rods.move(k % 20 == 0 ? kEncoderStep_m : 0, 2e-4, true);
    EXPECT_GT(sum / 400, 0.6);
  }
}

TEST(Observer, ASingleStepOfAnEncoderTurnsThemByAQuarterWhereTheWorldHoldsTheBucket) {
  Rods held, of_free_air;
  held.move(-kEncoderStep_m, 0, true);
  of_free_air.move(-kEncoderStep_m, 0, false);
  for (int k = 0; k < 30; ++k) {
    held.move(0, 0, true);
    of_free_air.move(0, 0, false);
  }
  EXPECT_GT(held.bristle(), 0.7);
  EXPECT_LT(held.bristle(), 0.9);
  EXPECT_LT(of_free_air.bristle(), 0);
}

}  // namespace
}  // namespace knuckle::estimation
