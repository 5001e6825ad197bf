// The default law: its gate, fades and bounds one by one, then a whole axis closed over delay.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "master/felt_law.h"
#include "tests/master/one_axis.h"

namespace knuckle::master {
namespace {

const PlanarVector kOut(0.6, 0.8);  // out of the wall
const PlanarVector kAlong(-0.8, 0.6);

/// The law alone, with inputs moved by hand.
struct LawBench {
  LawBench() {
    in.confidence = 1;
    in.engaged = true;
    run(1);  // confidence is believed after a while
  }
  PlanarVector run(double seconds) {
    PlanarVector force = PlanarVector::Zero();
    for (int i = 0; i < int(seconds * 1e3 + 0.5); ++i) {
      in.hand_m += 1e-3 * in.hand_mps;
      force = law.step(in, 1e-3);
    }
    return force;
  }
  /// In contact, felt force settled: the hand 2 mm inside the machine's tip.
  void press(double reflected_N = 2) {
    in.reflected_N = reflected_N * kOut;
    in.machine_m = 2e-3 * kOut;
    in.ahead_m = in.hand_m - in.machine_m;
    run(30);
  }
  EchoSpring law{DeviceDescription::Feel{}};
  FeltInputs in;
};

TEST(EchoSpring, AMachineThatLagsAtTheTouchLeavesNoErrorOnceItStands) {
  LawBench bench;
  bench.in.reflected_N = 2 * kOut;
  bench.in.machine_m = 20e-3 * kOut;
  bench.in.ahead_m = -20e-3 * kOut;
  bench.run(0.3);
  bench.in.machine_m = 2e-3 * kOut;
  bench.in.ahead_m = -2e-3 * kOut;
  bench.run(0.6);
  EXPECT_NEAR(bench.run(1e-3).dot(kOut), 2, 0.3);
}

TEST(EchoSpring, FeelsNothingInFreeMotionHoweverFarTheMachineLags) {
  LawBench bench;
  bench.in.hand_mps = PlanarVector(0.1, 0);
  bench.in.machine_mps = PlanarVector(0.1, 0);
  bench.in.reflected_N = PlanarVector(0.25, 0);
  for (int i = 0; i < 2000; ++i) ASSERT_EQ(bench.run(1e-3).norm(), 0);
}

TEST(EchoSpring, OpensAboveItsThresholdWhichGrowsWithNoiseAndSpeed) {
  struct Case {
    double sigma_N, speed_mps, closed_N, open_N;
  };
  for (const Case c : {Case{0, 0, 0.29, 0.31}, Case{0.1, 0, 0.39, 0.41}, Case{0, 0.1, 1.4, 1.6}}) {
    LawBench bench;
    bench.in.sigma_N = c.sigma_N;
    bench.in.machine_mps = PlanarVector(c.speed_mps, 0);
    bench.in.reflected_N = c.closed_N * kOut;
    bench.run(0.5);
    EXPECT_FALSE(bench.law.contact()) << c.sigma_N << " " << c.speed_mps;
    bench.in.reflected_N = c.open_N * kOut;
    bench.run(0.01);
    EXPECT_TRUE(bench.law.contact()) << c.sigma_N << " " << c.speed_mps;
  }
}

TEST(EchoSpring, FrictionWithinItsConeDoesNotTurnTheNormalButAWallThatTurnsDoes) {
  const auto across_of = [](double tangent) {
    LawBench bench;
    bench.press();
    bench.in.reflected_N += 2 * tangent * kAlong;
    bench.run(3);
    return bench.law.normal().dot(kAlong);
  };
  EXPECT_NEAR(across_of(0.2), 0, 1e-3);
  EXPECT_NEAR(across_of(-0.2), 0, 1e-3);
  EXPECT_GT(across_of(1), std::sin(std::atan(1.0) - 0.26));
}

TEST(EchoSpring, HoldsTheHandAcrossTheNormalWhileFrictionTurnsRound) {
  LawBench bench;
  bench.press();
  const PlanarVector still_m = bench.in.hand_m;
  bench.in.reflected_N += 0.6 * kAlong;
  bench.run(0.5);
  bench.in.reflected_N = 2 * kOut;  // on its way to the other side
  bench.in.hand_m = still_m + 1.5e-3 * kAlong;
  EXPECT_LT(bench.run(0.3).dot(kAlong), -0.3);
  bench.in.hand_m = still_m;
  bench.run(8);  // seen no more: a wall without friction
  bench.in.hand_m = still_m + 1.5e-3 * kAlong;
  EXPECT_NEAR(bench.run(0.1).dot(kAlong), 0, 0.05);
}

TEST(EchoSpring, NeverPullsIntoTheWall) {
  LawBench bench;
  bench.press();
  bench.in.hand_mps = 0.03 * kOut;  // the hand draws back while the machine still reports force
  for (int i = 0; i < 500; ++i) ASSERT_GE(bench.run(1e-3).dot(kOut), 0);
}

TEST(EchoSpring, HoldsAQuietContactForASecondThenFadesOverFourTenths) {
  LawBench bench;
  bench.press();
  bench.in.reflected_N = 0.05 * kOut;
  bench.run(0.99);
  EXPECT_TRUE(bench.law.contact());
  bench.run(0.02);
  EXPECT_FALSE(bench.law.contact());
  EXPECT_GT(bench.run(0.1).norm(), 0.5);
  EXPECT_EQ(bench.run(0.35).norm(), 0);
}

TEST(EchoSpring, ClosesAtOnceWhenTheHandLeavesAndIsWaryForASecond) {
  LawBench bench;
  bench.press();
  bench.in.reflected_N = 0.25 * kOut;
  bench.in.hand_mps = 6e-3 * kOut;
  bench.run(0.049);
  EXPECT_TRUE(bench.law.contact());
  bench.run(0.002);
  EXPECT_FALSE(bench.law.contact());
  EXPECT_EQ(bench.run(0.06).norm(), 0);
  bench.in.hand_mps.setZero();
  bench.in.reflected_N = 0.5 * kOut;  // above R_on, below its double
  bench.run(0.8);
  EXPECT_FALSE(bench.law.contact());
  bench.run(0.3);
  EXPECT_TRUE(bench.law.contact());
}

/// Pressed with 2 N, then the machine breaks through: the contact is gone while the hand still pushes.
LawBench broken_through() {
  LawBench bench;
  bench.press();
  bench.in.reflected_N.setZero();
  bench.in.machine_m -= 1e-3 * kOut;
  bench.run(0.1);
  EXPECT_FALSE(bench.law.contact());
  return bench;
}

TEST(EchoSpring, AHandThatRunsOnAfterALostContactIsCaughtForASecondNeverHarderThanItPressed) {
  LawBench bench = broken_through();
  bench.in.hand_mps = -0.01 * kOut;
  const PlanarVector caught_N = bench.run(1e-3);
  EXPECT_NEAR(caught_N.dot(kOut), 1, 0.05) << "100 N s/m";
  EXPECT_NEAR(caught_N.dot(kAlong), 0, 1e-9);
  bench.in.hand_mps = -0.5 * kOut;
  EXPECT_LE(bench.run(1e-3).norm(), 2);
  EXPECT_GT(bench.run(0.3).norm(), 0.5);
  EXPECT_EQ(bench.run(0.7).norm(), 0);
}

TEST(EchoSpring, AHandThatLeavesALostContactIsFree) {
  LawBench bench = broken_through();
  bench.in.hand_mps = 0.1 * kOut + 0.1 * kAlong;
  EXPECT_EQ(bench.run(0.05).norm(), 0);
}

TEST(EchoSpring, FrictionAcrossTheNormalIsFeltAndNoMoreThanThat) {
  LawBench bench;
  bench.in.reflected_N = 2 * kOut;
  bench.in.machine_m = 2e-3 * kOut;
  bench.in.ahead_m = -bench.in.machine_m;
  bench.run(30);
  // The hand has gone 1 mm along the wall; the machine's tip sticks behind.
  bench.in.hand_m += 1e-3 * kAlong;
  bench.in.ahead_m += 1e-3 * kAlong;
  bench.in.reflected_N = 2 * kOut - 0.4 * kAlong;
  for (int k = 0; k < 1000; ++k) ASSERT_GE(bench.run(1e-3).dot(kAlong), -0.5) << "1 N of spring, 0.4 N of friction";
  EXPECT_NEAR((bench.run(30) - bench.in.reflected_N).norm(), 0, 0.1);
}

TEST(EchoSpring, KeepsAContactThatStillPressesThoughTheHandMovesAway) {
  LawBench bench;
  bench.press();
  bench.in.hand_mps = 6e-3 * kOut;
  bench.run(0.2);
  EXPECT_TRUE(bench.law.contact());
}

TEST(EchoSpring, ClosesAtOnceWhenTheWallGivesWayButNotOnABounce) {
  LawBench broken, bounced;
  for (LawBench* bench : {&broken, &bounced}) {
    bench->press();
    bench->in.reflected_N = 0.2 * kOut;
    bench->in.machine_m += (bench == &broken ? -0.5e-3 : 0.5e-3) * kOut;
    bench->run(0.01);
  }
  EXPECT_FALSE(broken.law.contact());
  EXPECT_EQ(broken.run(0.06).norm(), 0);
  EXPECT_TRUE(bounced.law.contact());
}

TEST(EchoSpring, LeaksItsBiasWhileNothingIsReflected) {
  LawBench bench;
  bench.press(1);
  EXPECT_NEAR(bench.law.bias_N(), -1, 0.01);  // the spring alone would give 2 N
  bench.in.reflected_N.setZero();
  bench.run(0.6);
  EXPECT_TRUE(bench.law.contact());
  EXPECT_NEAR(bench.law.bias_N(), 0, 0.06);
}

TEST(EchoSpring, BoundsBiasForceAndTangentialDamping) {
  LawBench bench;
  bench.press(7);
  EXPECT_DOUBLE_EQ(bench.law.bias_N(), 2.5);
  bench.in.machine_m = 50e-3 * kOut;
  EXPECT_NEAR(bench.run(2).norm(), 8, 1e-9);
  LawBench sliding;
  sliding.press(2);
  sliding.in.hand_mps = 0.1 * kAlong;
  const PlanarVector force = sliding.run(0.01);
  EXPECT_NEAR(force.dot(kAlong), -0.3 * force.dot(kOut), 1e-6);
}

/// Hand and machine move on together at 30 mm/s against 1 N, the machine 5 mm behind.
LawBench moving_along(double contact_compliance) {
  LawBench bench;
  bench.in.contact_compliance = contact_compliance;
  bench.in.reflected_N = kOut;
  bench.in.hand_mps = bench.in.machine_mps = -0.03 * kOut;
  bench.in.ahead_m = -5e-3 * kOut;
  bench.in.machine_m = bench.in.hand_m - bench.in.ahead_m;
  for (int i = 0; i < 5000; ++i) {  // a trail worth 5 N is learned at 2 N/s
    bench.run(1e-3);
    bench.in.machine_m += 1e-3 * bench.in.machine_mps;
  }
  return bench;
}

TEST(EchoSpring, WhatMovesAlongIsFeltAsItsForceHoweverFarTheMachineTrails) {
  LawBench soil = moving_along(1);
  EXPECT_NEAR(soil.run(1e-3).dot(kOut), 1, 0.05);
  LawBench wall = moving_along(0);  // the trail, the anchor's own lag and the damping are felt on top
  EXPECT_GT(wall.run(1e-3).dot(kOut), 5);
}

TEST(EchoSpring, WhatMovesAlongIsFeltAsItsForceAlsoWhereTheTrailGrows) {
  LawBench soil = moving_along(1);
  for (int i = 0; i < 500; ++i) {
    soil.in.ahead_m = -(5e-3 + 8e-6 * i) * kOut;  // by 4 N of the spring in half a second
    soil.in.machine_m = soil.in.hand_m - soil.in.ahead_m;
    EXPECT_NEAR(soil.run(1e-3).dot(kOut), 1, 1) << i;  // followed within 0.1 s; by 2 N/s only, it would be 3 N off
  }
}

TEST(EchoSpring, SpeedThatWasCarriedEndsWithTheMessages) {
  LawBench bench = moving_along(1);
  bench.in.hand_mps.setZero();
  bench.in.silence_s = 0.2;
  EXPECT_NEAR(bench.run(0.7).dot(kOut), 1, 0.1) << "the hand rests: no damping against a speed of long ago";
}

TEST(EchoSpring, TheLoadIsFeltBesideTheContactWhateverItsThreshold) {
  LawBench bench;
  bench.in.load_N = PlanarVector(0, -0.2);  // below R_on
  double last_N = 0;
  for (int i = 0; i < 1000; ++i) {
    const double felt_N = bench.run(1e-3).norm();
    EXPECT_LT(felt_N - last_N, 0.01) << "no step";
    last_N = felt_N;
  }
  EXPECT_LT((bench.run(1e-3) - bench.in.load_N).norm(), 0.01);
  EXPECT_FALSE(bench.law.contact());
  bench.in.engaged = false;
  EXPECT_LT(bench.run(1).norm(), 0.01);
  bench.in.engaged = true;
  bench.run(1);
  bench.in.silence_s = 0.6;
  EXPECT_LT(bench.run(1e-3).norm(), 0.01) << "nor of a machine that is not heard";
}

TEST(EchoSpring, TheLoadIsNoPartOfWhatAnswersTheContact) {
  LawBench bench;
  bench.press(2);
  const PlanarVector alone_N = bench.law.contact_N();
  EXPECT_NEAR((alone_N - bench.run(0.1)).norm(), 0, 1e-9);
  bench.in.load_N = PlanarVector(0, -1.5);
  EXPECT_GT((bench.run(1) - alone_N).norm(), 1.4);
  EXPECT_NEAR((bench.law.contact_N() - alone_N).norm(), 0, 0.05);
}

TEST(EchoSpring, ALoadThatIsNotTrustedIsNotFelt) {
  LawBench bench;
  bench.in.load_N = PlanarVector(0, -3);
  EXPECT_NEAR(bench.run(1).norm(), 3, 0.1);
  bench.in.confidence = 0;
  EXPECT_NEAR(bench.run(2).norm(), 0, 0.01);
}

TEST(EchoSpring, AForceThatBecomesALoadStaysTheSame) {
  LawBench bench;
  bench.press(1);
  for (int i = 0; i <= 300; ++i) {  // the machine's side hands it over within 0.3 s, and no longer gives way to it
    const double share = i / 300.0;
    bench.in.reflected_N = (1 - share) * kOut;
    bench.in.load_N = share * kOut;
    bench.in.machine_m = (2 - share) * 1e-3 * kOut;
    bench.in.ahead_m = -bench.in.machine_m;
    EXPECT_NEAR(bench.run(1e-3).dot(kOut), 1, 0.2) << i;
  }
  for (int i = 0; i < 3000; ++i) EXPECT_NEAR(bench.run(1e-3).dot(kOut), 1, 0.25) << i;
  EXPECT_NEAR(bench.run(1).dot(kOut), 1, 0.02);
}

TEST(EchoSpring, ATurningNormalMovesNoForceIntoTheAnchor) {
  LawBench bench;
  const PlanarVector far(0.25, -0.1);  // hand and machine well away from the frame's origin
  bench.in.hand_m = far;
  bench.in.machine_m = far + 2e-3 * kOut;
  bench.in.ahead_m = far - bench.in.machine_m;
  bench.in.reflected_N = 2 * kOut;
  bench.run(10);
  bench.in.reflected_N = 2 * (Eigen::Rotation2Dd(0.35) * kOut);  // friction turns the force by 20 degrees
  for (int i = 0; i < 3000; ++i) EXPECT_NEAR(bench.run(1e-3).norm(), 2, 0.25);
}

TEST(EchoSpring, HoldsAFrozenAnchorThroughThreeTenthsOfSilenceThenFadesOverTwo) {
  LawBench bench;
  bench.press();
  const auto silence = [&](double until_s) {
    PlanarVector force;
    for (; bench.in.silence_s < until_s; bench.in.silence_s += 1e-3) force = bench.run(1e-3);
    return force.norm();
  };
  EXPECT_NEAR(silence(0.299), 2, 0.02);
  EXPECT_NEAR(silence(0.4), 1, 0.05);
  EXPECT_EQ(silence(0.51), 0);
  EXPECT_FALSE(bench.law.contact());
}

TEST(EchoSpring, StaysAwayFromContactWhileNotEngagedAndFadesWhenItEnds) {
  LawBench bench;
  bench.press();
  bench.in.engaged = false;
  EXPECT_GT(bench.run(0.02).norm(), 0.5);
  EXPECT_EQ(bench.run(0.06).norm(), 0);
  bench.run(1);
  EXPECT_FALSE(bench.law.contact());
}

TEST(EchoSpring, FadesWithConfidence) {
  LawBench bench;
  bench.press();
  bench.in.confidence = 0.25;
  EXPECT_NEAR(bench.run(2).norm(), 1, 0.1);
  bench.in.confidence = 0;
  EXPECT_LT(bench.run(2).norm(), 0.01);
}

// ---- One axis, closed over the link ----

struct Cell {
  double round_trip_s, wall_N_per_m;
  sim::LimbClass limb;
};
class ClosedAxis : public testing::TestWithParam<Cell> {};

test::OneAxisCase axis_case(const Cell& cell, std::uint64_t seed, double asked_N = 1.5) {
  test::OneAxisCase setting;
  setting.round_trip_s = cell.round_trip_s;
  setting.wall_N_per_m = cell.wall_N_per_m;
  setting.limb = sim::sample_limb(cell.limb, seed);
  setting.press_m = asked_N / setting.limb.stiffness_N_per_m + asked_N / 1000;
  setting.approach_mps = 0.025;
  return setting;
}

TEST_P(ClosedAxis, HoldsWithoutCyclingAndWithinThreeTenthsOfANewton) {
  const Cell cell = GetParam();
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(testing::Message() << "limb " << sim::name(cell.limb) << " seed " << seed << " RTT "
                                    << cell.round_trip_s << " wall " << cell.wall_N_per_m);
    const test::HoldResult result = test::hold(axis_case(cell, seed));
    EXPECT_TRUE(result.stable()) << result.swing_N;
    EXPECT_LT(result.error_N, 0.3);
    EXPECT_GT(result.true_N, 0.5);  // the hold was a hold
    EXPECT_LT(result.released_s, 1);
    EXPECT_LT(result.energy_J, 0.03);
    EXPECT_LT(result.slew_N_per_ms, 0.5);
  }
}
std::vector<Cell> cells() {
  std::vector<Cell> all;
  for (const double round_trip_s : {0.002, 0.02, 0.1, 0.4}) {
    for (const double wall : {5e4, 1e6, 2e7}) {
      for (const auto limb : {sim::LimbClass::kRelaxed, sim::LimbClass::kCoContracted, sim::LimbClass::kLightGrip}) {
        all.push_back({round_trip_s, wall, limb});
      }
    }
  }
  return all;
}
INSTANTIATE_TEST_SUITE_P(EchoSpring, ClosedAxis, testing::ValuesIn(cells()));

TEST(EchoSpring, FollowsTheTrueForceQuickly) {
  for (const double round_trip_s : {0.002, 0.02, 0.1, 0.4}) {
    const auto result = test::hold(axis_case({round_trip_s, 1e6, sim::LimbClass::kCoContracted}, 1));
    EXPECT_LT(result.rise_s, round_trip_s > 0.1 ? 1.0 : 0.4) << round_trip_s;
  }
}

TEST(EchoSpring, TakesAForceEstimateTenPercentOffWithoutCycling) {
  for (const double error : {0.9, 1.1}) {
    auto setting = axis_case({0.1, 1e6, sim::LimbClass::kNormal}, 2, 3);
    setting.force_error = error;
    const auto result = test::hold(setting);
    EXPECT_TRUE(result.stable());
    EXPECT_LT(result.error_N, 0.15 * result.true_N);
  }
}

}  // namespace
}  // namespace knuckle::master
