// What the bias filter learns in free motion, and what it must not learn.
#include "estimation/bias_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "estimation/force_estimator.h"
#include "tests/estimation/test_machine.h"
#include "tests/estimation/twin.h"

namespace knuckle::estimation {
namespace {

TEST(BiasFilter, LearnsTodaysOilFromTwentySecondsOfFreeMotion) {
  Twin unlearned(oil_of_today());
  const double before = unlearned.no_load_N(3);
  EXPECT_TRUE(unlearned.estimator().estimate().confidence_reasons & kBiasNotLearned);
  unlearned.free_motion(27);
  const double after = unlearned.no_load_N(20);
  EXPECT_GT(before, 100);
  EXPECT_LT(after, 35);
  EXPECT_FALSE(unlearned.estimator().estimate().confidence_reasons & kBiasNotLearned);
}

TEST(BiasFilter, SlowPressOnAWallIsNeverLearned) {
  Twin run(oil_of_today());
  run.free_motion(30);
  run.stop();
  const BiasVector before = run.estimator().learned().state();
  const PlanarVector push(-2000, 0);
  for (double t = 0; t < 5; t += kStep_s) run.step(push * t / 5, 0);
  for (double t = 0; t < 20; t += kStep_s) run.step(push, 0);
  EXPECT_LT((run.estimator().learned().state() - before).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((run.estimator().estimate().tip_N - push).norm(), 250);
  EXPECT_TRUE(run.estimator().estimate().contact);
}

TEST(BiasFilter, SlowPressWhileMovingIsNotLearnedAway) {
  // Worse than a wall: the rods move all the time, so only the size of the force gives it away.
  Twin run(oil_of_today());
  run.free_motion(30);
  const PlanarVector push(-2000, 0);
  for (double t = 0; t < 5; t += kStep_s) run.step(push * t / 5);
  double sum = 0;
  for (double t = 0; t < 20; t += kStep_s) sum += run.step(push).tip_N.x() * kStep_s;
  EXPECT_NEAR(sum / 20, -2000, 100);
  run.free_motion(2);
  EXPECT_LT(run.no_load_N(10), 60);
}

TEST(BiasFilter, LearnsFrictionOfSealsByPressure) {
  SyntheticErrors e = real_sensors();
  e.seal_m2 = 6e-5;    // 2 % of the piston areas
  e.back_swing = 0.9;  // else it looks like Coulomb friction and load
  Twin run(e);
  const double before_N = run.no_load_N(5);
  run.free_motion(60);
  EXPECT_LT(run.no_load_N(20), 0.5 * before_N);
  EXPECT_LT(run.no_load_N(20), 60);
  EXPECT_FALSE(run.estimator().estimate().contact);
  const BiasVector& learned = run.estimator().learned().state();
  for (int i = 0; i < kJoints; ++i) EXPECT_NEAR(learned[kBiasSeal + i], e.seal_m2, 0.5 * e.seal_m2) << i;
}

TEST(BiasFilter, OperatorsWordLetsALargeErrorBeLearned) {
  SyntheticErrors e = real_sensors();
  e.bias_N = JointVector(6000, 0, 0);  // far beyond the prior: a transmitter 18 bar off
  Twin stuck(e), told(e);
  told.estimator().expect_free_motion(true);
  stuck.free_motion(60);
  told.free_motion(60);
  EXPECT_TRUE(stuck.estimator().estimate().contact);
  EXPECT_LT(told.no_load_N(10), 0.5 * stuck.no_load_N(10));
}

TEST(BiasFilter, LearnsNothingWhileSomethingMayHang) {
  Twin run(oil_of_today());
  run.free_motion(25);
  const BiasVector before = run.estimator().learned().state();
  run.estimator().hold_bias(true);
  for (double t = 0; t < 20; t += kStep_s) run.step({0, -60});
  EXPECT_EQ((run.estimator().learned().state() - before).norm(), 0);
}

TEST(BiasFilter, PriorOfACalibratedMachineIsItsCovarianceAndWhatADayChanges) {
  const MachineDescription known = calibrated_twin(oil_of_today(), 10), vague = calibrated_twin(oil_of_today(), 200);
  const auto sigma = [](const MachineDescription& machine, int state) {
    return std::sqrt(BiasFilter(machine).covariance()(state, state));
  };
  for (int i = 0; i < kJoints; ++i) {
    EXPECT_LT(sigma(known, kBiasOffset + i), 0.3 * sigma(test_machine(), kBiasOffset + i));
    EXPECT_GT(sigma(known, kBiasOffset + i), 25) << "transmitters drift from day to day";
    EXPECT_GT(sigma(vague, kBiasOffset + i), 140) << "what identification left uncertain stays so";
    EXPECT_NEAR(sigma(known, kBiasViscous + i), 0.4 * 25e3, 100) << "oil is another every day";
  }
}

TEST(BiasFilter, NormalisedInnovationsTellWhetherTheModelFits) {
  Twin fits(real_sensors());
  fits.free_motion(40);
  const double quiet = fits.estimator().learned().mean_nis();
  EXPECT_GT(quiet, 0.1);
  EXPECT_LT(quiet, 2);
  // A hidden pull that swings beside the motion is no friction, offset or weight: updates disagree with their
  // variances.
  fits.estimator().expect_free_motion(true);
  for (double t = 0; t < 20; t += kStep_s) fits.step(300 * PlanarVector(std::sin(3 * t), std::cos(4 * t)));
  EXPECT_GT(fits.estimator().learned().mean_nis(), 2 * quiet);
}

/// An arm that swings on its oil while it moves.
Twin swinging(const std::array<double, 6>& lag_s) {
  SyntheticErrors e = real_sensors();
  e.lag_s = lag_s;
  Twin run(e);
  run.motion.swing_rad = JointVector(0.02, 0.01, 0.01);
  return run;
}

/// Free motion of 20 s without contact. @return the largest torque of the fast channel.
double fast_Nm_without_contact(Twin& run) {
  double fast_Nm = 0;
  for (double t = 0; t < 20; t += kStep_s) {
    const ForceEstimate& found = run.step(PlanarVector::Zero());
    fast_Nm = std::max(fast_Nm, found.fast_torque_Nm.cwiseAbs().maxCoeff());
    EXPECT_FALSE(found.contact) << "after " << t << " s";
    EXPECT_LT(found.tip_N.norm(), 150) << "after " << t << " s";
    if (testing::Test::HasFailure()) break;
  }
  return fast_Nm;
}

// A swing's torque is a quarter of a period away from what late pressures make of it: unknown, the lag is a force.
TEST(BiasFilter, LearnsHowLateTransmittersAreFromAnArmThatSwings) {
  for (const double lag_s : {0.0, 2e-3, 8e-3}) {
    SCOPED_TRACE(lag_s);
    Twin run = swinging({lag_s, lag_s, lag_s, lag_s, lag_s, lag_s});
    run.free_motion(60);
    EXPECT_NEAR(run.estimator().learned().state()[kBiasLag], lag_s, 1.5e-3);
    EXPECT_LT(fast_Nm_without_contact(run), 300);  // 8 ms not taken off: 440
  }
}

// A lag that nobody has learned yet may be anything near the usual one: what it makes of a swing must be doubted.
TEST(BiasFilter, ASwingIsNoContactWhileTheLagIsUnknown) {
  constexpr double kGrowth_radps = 0.2 * std::numbers::pi;
  for (const double lag_s : {0.0, 12e-3}) {  // where 5 ms are expected
    for (const double swing_radps : {12.0, 16.0, 20.0}) {
      Twin run = swinging({lag_s, lag_s, lag_s, lag_s, lag_s, lag_s});
      run.estimator().hold_bias(true);
      run.motion.swing_rad.setZero();
      run.free_motion(60);  // calm: all that shakes free motion is known well
      run.motion.swing_radps = swing_radps;
      for (double phase = 0; phase < std::numbers::pi; phase += kGrowth_radps * kStep_s) {
        run.motion.grow_swing(JointVector(0.08, 0.03, 0.03) * 12 / swing_radps, phase, kGrowth_radps);
        ASSERT_FALSE(run.step(PlanarVector::Zero()).contact) << lag_s << " s, " << swing_radps << ", at " << phase;
      }
    }
  }
}

}  // namespace
}  // namespace knuckle::estimation
