// Force-limited approach: slows what presses, and nothing else.
#include "slave/assist.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>

#include "core/units.h"
#include "tests/slave/reasons.h"
#include "tests/slave/test_machine.h"

namespace knuckle::slave {
namespace {

constexpr double kLimit_N = 1500, kFree_mps = 0.025;
const JointVector kPose(0.3, -1.5, -0.8);

const Eigen::Matrix<double, 2, 3>& jacobian() {
  static const Eigen::Matrix<double, 2, 3> here = Kinematics(test::test_machine()).tip_jacobian(kPose);
  return here;
}
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
TipContact steady(const PlanarVector& force_N, double direction_trust = 1) {
  return {force_N, force_N, direction_trust};
}
estimation::ForceEstimate estimate(const PlanarVector& tip_N, double confidence) {
  estimation::ForceEstimate force;
  force.fast_torque_Nm = jacobian().transpose() * tip_N;
  force.measurement_variance_Nm2 = JointVector::Constant(2500);
  force.confidence = confidence;
  return force;
}

/// Joint rates that move the tip so.
JointVector towards(const PlanarVector& tip_mps) {
  const Eigen::Matrix2d square = jacobian() * jacobian().transpose();
  return jacobian().transpose() * square.inverse() * tip_mps;
}

double tip_mps(const LimitedApproach& result) {
  return (jacobian() * result.rate_radps).norm();
}

TEST(ForceLimitedApproach, ChangesNothingWhileItIsOff) {
  const JointVector rate(0.5, -0.4, 0.3);
  const auto result = limit_approach(rate, jacobian(), steady({-9000, 0}), 0);
  EXPECT_EQ(result.rate_radps, rate);
  EXPECT_FALSE(result.limiting);
  EXPECT_TRUE(limit_approach(rate, jacobian(), {}, 0.5).limiting) << "half a newton is a limit";
}

TEST(ForceLimitedApproach, KeepsTheTipSlowInFreeAirWhicheverWayItGoes) {
  for (const JointVector& rate : {JointVector(0.5, -0.4, 0.3), JointVector(-0.5, 0.4, -0.3)}) {
    const auto result = limit_approach(rate, jacobian(), steady({-50, 20}), kLimit_N);
    EXPECT_TRUE(result.limiting);
    EXPECT_NEAR(tip_mps(result), kFree_mps, 1e-12);
    EXPECT_NEAR(result.rate_radps.normalized().dot(rate.normalized()), 1, 1e-12);
  }
  const auto slow = limit_approach({0.001, 0.001, 0}, jacobian(), {}, kLimit_N);
  EXPECT_FALSE(slow.limiting);
}

TEST(ForceLimitedApproach, AForeseenForceFreesNoMotion) {
  const JointVector rate(0.5, -0.4, 0.3);
  const PlanarVector along = jacobian() * rate;
  const TipContact foreseen{PlanarVector::Zero(), 5000 * along.normalized(), 1};
  EXPECT_NEAR(tip_mps(limit_approach(rate, jacobian(), foreseen, kLimit_N)), kFree_mps, 1e-12);
}

TEST(ForceLimitedApproach, NoRateGrowsTurnsOrComesFromNothing) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 20000; ++k) {
    JointVector rate(normal(random), normal(random), normal(random));
    if (k % 5 == 0) rate[k % 3] = 0;
    const TipContact contact{PlanarVector(normal(random), normal(random)) * 1500,
                             PlanarVector(normal(random), normal(random)) * 1500, 0.25 * (k % 5)};
    const auto result = limit_approach(rate, jacobian(), contact, kLimit_N);
    for (int i = 0; i < kJoints; ++i) {
      ASSERT_LE(std::abs(result.rate_radps[i]), std::abs(rate[i]) * (1 + 1e-12));
      ASSERT_GE(result.rate_radps[i] * rate[i], 0);
    }
    const double ahead_N = contact.ahead_N.norm();
    if (ahead_N < kLimit_N) continue;
    ASSERT_LE((jacobian() * result.rate_radps).dot(-contact.ahead_N / ahead_N), 1e-9);
  }
}

// Two joints that move the tip along x and y, with numbers that binary fractions say exactly.
TEST(ForceLimitedApproach, WhatIsWithinItsBoundIsNotSlowedAndNotCalledSlowed) {
  Eigen::Matrix<double, 2, 3> square;
  square << 1, 0, 0, 0, 1, 0;
  AssistLimits limits;
  limits.free_Ns_per_m = 8000;
  const auto approach = [&](const JointVector& rate, const TipContact& contact) {
    return limit_approach(rate, square, contact, 1000, limits);
  };
  EXPECT_FALSE(approach({0.125, 0, 0}, {}).limiting) << "the speed of free air";
  EXPECT_TRUE(approach({0.1251, 0, 0}, {}).limiting);
  EXPECT_FALSE(approach({0, 0, 0}, steady({-1000, 0})).limiting) << "standing at the limit";
  EXPECT_FALSE(approach({0.0625, 0, 0}, steady({-500, 0})).limiting) << "half the speed at half the limit";
  EXPECT_TRUE(approach({0.0626, 0, 0}, steady({-500, 0})).limiting);
  EXPECT_NEAR(approach({0, 1, 0}, steady({-500, 0})).rate_radps[1], 0.125, 1e-12) << "along the surface is not away";
  const JointVector slowed = approach({0.11, 0.0078125, 0.25}, steady({-500, 0})).rate_radps;
  EXPECT_EQ(slowed.tail<2>(), Eigen::Vector2d(0.0078125, 0.25)) << "they do not press";
  EXPECT_LT(slowed[0], 0.0626);
}

TEST(ForceLimitedApproach, LeavingByHoweverLittleIsLeaving) {
  const JointVector rate = towards({0.001, 0.3});
  EXPECT_EQ(limit_approach(rate, jacobian(), steady({400, 0}), kLimit_N).rate_radps, rate);
  EXPECT_NEAR(tip_mps(limit_approach(rate, jacobian(), steady({-400, 0}), kLimit_N)), kFree_mps, 1e-12);
  // Up to a fifth of the limit a force has no direction that could be left.
  for (const double force_N : {299.0, 300.0})
    EXPECT_NEAR(tip_mps(limit_approach(rate, jacobian(), steady({force_N, 0}), kLimit_N)), kFree_mps, 1e-12) << force_N;
}

TEST(ForceLimitedApproach, OnlyJointsThatPressAreSlowedAndAllByOneFactor) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  int slowed = 0, mixed = 0;
  for (int k = 0; k < 5000; ++k) {
    const JointVector rate = 0.01 * JointVector(normal(random), normal(random), normal(random));
    const PlanarVector force = 900 * PlanarVector(normal(random), normal(random));
    const double force_N = force.norm();
    if (force_N < 310) continue;
    const JointVector added = -(force.transpose() * jacobian()).transpose().cwiseProduct(rate) / force_N;
    if ((jacobian() * rate).norm() > kFree_mps) continue;  // the other rule's
    const double allowed_mps = kFree_mps * std::max(0.0, 1 - force_N / kLimit_N);
    const auto result = limit_approach(rate, jacobian(), steady(force), kLimit_N);
    if (added.sum() <= allowed_mps) {
      EXPECT_EQ(result.rate_radps, rate);
      EXPECT_FALSE(result.limiting);
      continue;
    }
    ++slowed;
    mixed += added.minCoeff() < 0 ? 1 : 0;
    EXPECT_NEAR(-(jacobian() * result.rate_radps).dot(force) / force_N, allowed_mps, 1e-12);
    double factor = -1;
    for (int i = 0; i < kJoints; ++i) {
      if (added[i] <= 0) {
        EXPECT_EQ(result.rate_radps[i], rate[i]);
        continue;
      }
      if (factor < 0) factor = result.rate_radps[i] / rate[i];
      EXPECT_NEAR(result.rate_radps[i] / rate[i], factor, 1e-12);
    }
    EXPECT_TRUE(test::is(result.limiting, ReasonCode::kAssistForce));
  }
  EXPECT_GT(slowed, 200);
  EXPECT_GT(mixed, 100);
}

TEST(ForceLimitedApproach, TellsTheForceThatIsThereNotTheOneForeseen) {
  const PlanarVector now(-300, 400), ahead(-1200, 1600);
  JointVector pressing = -jacobian().transpose() * now;
  pressing *= 0.02 / (jacobian() * pressing).norm();  // slower than in free air: only the force ahead limits it
  const auto result = limit_approach(pressing, jacobian(), {now, ahead, 1}, kLimit_N);
  test::expect_reason(result.limiting, ReasonCode::kAssistForce, 0, 500, 1500, 1e-7);
  const auto unknown = limit_approach(pressing, jacobian(), steady({kNan, 0}), kLimit_N);
  test::expect_reason(unknown.limiting, ReasonCode::kAssistForceUnknown, 0, 0, 0, 0);
}

TEST(ForceLimitedApproach, AJointWhoseTorqueIsDoubtedCountsLess) {
  const PlanarVector pressed(-2000, 300);
  for (const bool by_bias : {false, true}) {
    for (int doubted = 0; doubted < kJoints; ++doubted) {
      auto force = estimate(pressed, 1);
      force.measurement_variance_Nm2.setConstant(1);
      force.bias_variance_Nm2.setConstant(2);
      (by_bias ? force.bias_variance_Nm2 : force.measurement_variance_Nm2)[doubted] = 1e8;
      force.fast_torque_Nm[doubted] += 500;
      EXPECT_LT((raw_tip_force(jacobian(), force) - pressed).norm(), 1) << by_bias << doubted;
    }
  }
  // Nothing is known better than to 1 N m: below that all count alike.
  auto force = estimate(pressed, 1);
  force.bias_variance_Nm2.setZero();
  force.fast_torque_Nm += JointVector(100, -50, 80);
  force.measurement_variance_Nm2 = JointVector(1, 1, 1);
  const PlanarVector alike = raw_tip_force(jacobian(), force);
  force.measurement_variance_Nm2 = JointVector(0, 0.5, 1);
  EXPECT_EQ(raw_tip_force(jacobian(), force), alike);
  force.measurement_variance_Nm2 = JointVector(1, 1.5, 1);
  EXPECT_GT((raw_tip_force(jacobian(), force) - alike).norm(), 1);
}

TEST(ForceLimitedApproach, DistrustNeverMakesTheForceLess) {
  const PlanarVector pressed(-2000, 300);
  for (const double confidence : {1.0, 0.4, 0.2, 0.1, 0.05, 0.0}) {
    for (const double variance : {1.0, 2500.0, 1e6, 1e9}) {
      auto force = estimate(pressed, confidence);
      force.measurement_variance_Nm2.setConstant(variance);
      EXPECT_LT((raw_tip_force(jacobian(), force) - pressed).norm(), 1) << confidence << ' ' << variance;
    }
  }
}

TEST(ForceLimitedApproach, WithoutTrustItHoldsAgainstTheLimitAndLeavesAtTheSpeedOfFreeAir) {
  const JointVector rate(0.3, 0.3, 0);
  const PlanarVector along = (jacobian() * rate).normalized();
  const auto pressing = limit_approach(rate, jacobian(), steady(-2 * kLimit_N * along, 0), kLimit_N);
  EXPECT_LE((jacobian() * pressing.rate_radps).dot(along), 1e-12);
  test::expect_reason(pressing.limiting, ReasonCode::kAssistForce, 0, 2 * kLimit_N, kLimit_N, 1e-7);
  const auto leaving = limit_approach(rate, jacobian(), steady(2 * kLimit_N * along, 0), kLimit_N);
  EXPECT_NEAR(tip_mps(leaving), kFree_mps, 1e-12);
  const auto half = limit_approach(rate, jacobian(), steady(2 * kLimit_N * along, 0.5), kLimit_N);
  EXPECT_NEAR(tip_mps(half), 2 * kFree_mps, 1e-12);
}

TEST(ForceLimitedApproach, AForceThatIsNotFiniteHoldsTheArmStillAndSaysWhy) {
  auto force = estimate({-2000, 300}, 1);
  force.fast_torque_Nm[1] = kNan;
  const PlanarVector unknown = raw_tip_force(jacobian(), force);
  const double huge = std::numeric_limits<double>::max();
  for (const TipContact& contact : {steady(unknown), steady({huge, 0}), TipContact{{-500, 0}, {kNan, 0}, 1}}) {
    const auto result = limit_approach({0.3, -0.3, 0.2}, jacobian(), contact, kLimit_N);
    EXPECT_EQ(result.rate_radps, JointVector(0, 0, 0));
    EXPECT_TRUE(test::is(result.limiting, ReasonCode::kAssistForceUnknown));
  }
}

TEST(RisingForce, LooksAheadOfARiseAndNeverBelowWhatIs) {
  RisingForce rising(0.005);
  EXPECT_EQ(rising.step({-100, 0}).ahead_N, PlanarVector(-100, 0)) << "nothing is known of the rise yet";
  TipContact contact;
  for (int k = 1; k <= 100; ++k) contact = rising.step({-100 - 50 * k, 0});
  EXPECT_NEAR(contact.ahead_N.x() - contact.now_N.x(), -1e4 * 0.15, 1);
  for (int k = 1; k <= 50; ++k) {
    contact = rising.step({-5100 + 50 * k, 0});
    EXPECT_GE(contact.ahead_N.norm(), contact.now_N.norm());
  }
}

TEST(RisingForce, FollowsARiseWithEightHertz) {
  RisingForce rising(0.005);
  rising.step({0, -100});
  double slope = 0;
  for (int k = 1; k <= 10; ++k) {
    const TipContact contact = rising.step({0, -100 - 50.0 * k});
    slope += (1 - std::exp(-2 * 3.14159265358979 * 8 * 0.005)) * (-1e4 - slope);
    EXPECT_NEAR(contact.ahead_N.y() - contact.now_N.y(), 0.15 * slope, 1e-6) << k;
    EXPECT_EQ(contact.ahead_N.x(), 0);
  }
  rising.reset();
  EXPECT_EQ(rising.step({0, -700}).ahead_N, PlanarVector(0, -700)) << "a rise from before is forgotten";
}

TEST(RisingForce, ForgetsWhatIsNotFinite) {
  RisingForce rising(0.005);
  rising.step({-100, 0});
  EXPECT_TRUE(std::isnan(rising.step({kNan, 0}).now_N.x()));
  EXPECT_EQ(rising.step({-900, 0}).ahead_N, PlanarVector(-900, 0)) << "no rise is known over the gap";
}

// A cylinder without transmitters.

Eigen::Matrix3d without_boom() {
  Eigen::Matrix3d covariance_Nm2 = JointVector(40, 25, 10).cwiseAbs2().asDiagonal();
  covariance_Nm2(kBoom, kBoom) = estimation::kUnknownVariance;
  return covariance_Nm2;
}
/// Arm and bucket in line: what pushes along them turns neither joint.
const JointVector kInLine(0.3, -1.5, 0.01);

TEST(UnseenForce, WhereTwoTorquesTellItNothingIsLimited) {
  const JointVector rate(0.3, -0.2, 0.4);
  const LimitedApproach result = limit_unseen(rate, jacobian(), without_boom(), {0, 0});
  EXPECT_EQ(result.rate_radps, rate);
  EXPECT_FALSE(result.limiting);
}

TEST(UnseenForce, TheTipDoesNotAdvanceTheWayInWhichAForceWouldNotBeSeen) {
  const PlanarJacobian here = Kinematics(test::test_machine()).tip_jacobian(kInLine);
  const double along_rad = kInLine.sum();
  const PlanarVector along(std::cos(along_rad), std::sin(along_rad));
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> evenly(-0.5, 0.5);
  int limited = 0;
  for (int k = 0; k < 500; ++k) {
    const JointVector rate(evenly(random), evenly(random), evenly(random));
    const LimitedApproach result = limit_unseen(rate, here, without_boom(), {0, 0});
    EXPECT_LT(std::abs(along.dot(here * result.rate_radps)), 0.01 + 0.05 * std::abs(along.dot(here * rate))) << k;
    for (int i = 0; i < kJoints; ++i) {
      EXPECT_GE(result.rate_radps[i] * rate[i], 0);
      EXPECT_LE(std::abs(result.rate_radps[i]), std::abs(rate[i]) + 1e-12);
    }
    if (!result.limiting) continue;
    ++limited;
    EXPECT_TRUE(test::is(result.limiting, ReasonCode::kForceUnknown));
    EXPECT_GT(result.limiting.value, kUnseenForce_N);
  }
  EXPECT_GT(limited, 300);
  // The bucket alone turns out of it.
  const LimitedApproach out = limit_unseen({0, 0, 0.4}, here, without_boom(), {0, 0});
  EXPECT_NEAR(out.rate_radps[kBucket], 0.4, 0.02);
}

// Else an operator who pressed there could not leave: what holds him back is the very force that is not seen.
TEST(UnseenForce, BackTheWayItCameTheTipIsNotHeld) {
  const JointVector rate(0.1, 0.2, -0.1);
  const PlanarJacobian here = Kinematics(test::test_machine()).tip_jacobian(kInLine);
  const PlanarVector moves_mps = here * rate;
  const auto turned = [&](double degrees) { return PlanarVector(Eigen::Rotation2Dd(degrees * kDegree) * moves_mps); };
  for (const double off : {0.0, 44.0, -44.0})
    EXPECT_EQ(limit_unseen(rate, here, without_boom(), -0.3 * turned(off)).rate_radps, rate) << off;
  const JointVector held = limit_unseen(rate, here, without_boom(), {0, 0}).rate_radps;
  ASSERT_LT(held.norm(), 0.95 * rate.norm());
  for (const double off : {46.0, -46.0, 90.0, 180.0})
    EXPECT_EQ(limit_unseen(rate, here, without_boom(), -turned(off)).rate_radps, held) << off;
}

}  // namespace
}  // namespace knuckle::slave
