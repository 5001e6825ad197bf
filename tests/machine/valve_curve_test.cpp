// A valve's edges: opening to flow and back.
#include <gtest/gtest.h>

#include <cmath>

#include "machine/arm_description.h"

namespace knuckle {
namespace {

ValveDescription curved(double exponent, double retract_share) {
  ValveDescription valve;
  valve.dead_band_extend = 0.1;
  valve.dead_band_retract = 0.2;
  valve.curve_exponent = exponent;
  valve.retract_share = retract_share;
  return valve;
}

TEST(ValveCurve, EachDirectionOpensBehindItsOwnDeadBand) {
  const ValveDescription valve = curved(2, 0.8);
  EXPECT_EQ(valve.opening(0.1), 0);
  EXPECT_EQ(valve.opening(-0.2), 0);
  EXPECT_NEAR(valve.opening(0.55), 0.5, 1e-12);
  EXPECT_NEAR(valve.opening(-0.6), 0.5, 1e-12);
  EXPECT_EQ(valve.opening(-1.5), 1);
}

TEST(ValveCurve, OpeningForAFlowIsTheInverseOfFlow) {
  for (const double exponent : {0.7, 1.0, 1.5, 2.2}) {
    ValveDescription valve = curved(exponent, 0.8);
    for (const double notch_opening : {0.0, 0.3, 0.9}) {
      valve.notch_opening = notch_opening;
      valve.notch_slope = notch_opening > 0 ? 0.6 : 1;
      for (const bool extends : {true, false}) {
        const double most = extends ? 1 : 0.8;
        for (double share = 0.02; share <= most; share += 0.01) {
          EXPECT_NEAR(valve.flow_share(valve.opening_for(share, extends), extends), share, 1e-12) << exponent;
        }
        EXPECT_EQ(valve.opening_for(0, extends), 0);
        EXPECT_EQ(valve.opening_for(2, extends), 1);
      }
    }
  }
}

TEST(ValveCurve, BehindItsNotchTheEdgeOpensFaster) {
  ValveDescription valve = curved(1, 0.8);
  valve.notch_opening = 0.4;
  valve.notch_slope = 0.5;
  EXPECT_NEAR(valve.flow_share(0.2, true), 0.1, 1e-12);
  EXPECT_NEAR(valve.flow_share(0.4, true), 0.2, 1e-12);
  EXPECT_NEAR(valve.flow_share(0.7, true), 0.6, 1e-12);
  EXPECT_NEAR(valve.flow_share(1, true), 1, 1e-12);
  EXPECT_NEAR(valve.flow_share(1, false), 0.8, 1e-12);
  valve.curve_exponent = 2;
  EXPECT_NEAR(valve.flow_share(0.7, true), 0.36, 1e-12);
}

TEST(ValveCurve, TheOpeningForAFlowNeverLetsMoreThrough) {
  for (const double exponent : {0.5, 0.7, 1.0, 1.4, 2.2}) {
    ValveDescription valve = curved(exponent, 1);
    for (const double notch_opening : {0.0, 0.3, 0.9}) {
      valve.notch_opening = notch_opening;
      valve.notch_slope = notch_opening > 0 ? 0.2 : 1;
      for (double share = 1e-4; share < 0.03; share *= 1.3)
        EXPECT_LE(valve.flow_share(valve.opening_for(share, true), true), share * (1 + 1e-9)) << exponent;
    }
  }
}

TEST(ValveCurve, TheInverseRisesWithoutAStepAndNeverSteeperThanItsStraightBeginning) {
  ValveDescription valve = curved(2.2, 1);
  for (const double slope : {1.0, 0.5}) {  // of the notch: so much more it has to open
    valve.notch_opening = 0.4;
    valve.notch_slope = slope;
    const double steepest = std::pow(0.02, 1 / 2.2) / 0.02 / slope;
    for (double share = 0; share < 1; share += 1e-4) {
      const double rise = valve.opening_for(share + 1e-4, true) - valve.opening_for(share, true);
      EXPECT_GT(rise, 0) << share;
      EXPECT_LE(rise, 1.0001e-4 * steepest) << share;
    }
  }
}

}  // namespace
}  // namespace knuckle
