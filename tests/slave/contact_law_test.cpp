// Compliance where the bucket is touched, the limit of the set-point, and a loop that is no faster than the oil allows.
#include "slave/contact_law.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <utility>

#include "machine/oil_stiffness.h"
#include "tests/slave/standing.h"
#include "tests/support/solar.h"

namespace knuckle::slave {
namespace {

const JointVector kPressing(0.6, -1.6, -1.0);

/// The arm at rest with a force somewhere on the bucket, estimated without error.
struct Bench {
  explicit Bench(const JointVector& pose = kPressing) : state(standing_at(pose, kinematics)) {}
  /// @param at_m bucket axes.
  PlanarJacobian jacobian_at(const PlanarVector& at_m) const {
    const PlanarVector from_tip_m =
        Eigen::Rotation2Dd(state.angle_rad.sum()) * (at_m - PlanarVector(test::solar().links[kBucket].length_m, 0));
    return kinematics.tip_jacobian(state.angle_rad) +
           PlanarVector(-from_tip_m.y(), from_tip_m.x()) * Eigen::RowVector3d::Ones();
  }
  Touch touched(const PlanarVector& force_N, const PlanarVector& at_m, double confidence = 1) const {
    estimation::ForceEstimate force;
    force.confidence = confidence;
    force.fast_torque_Nm = kinematics.tip_jacobian(state.angle_rad).transpose() * force_N;
    const JointVector torque_Nm = jacobian_at(at_m).transpose() * force_N;
    force.fast_couple_Nm = (torque_Nm - force.fast_torque_Nm).mean();
    return law.touch(state, force);
  }
  Touch at_tip(const PlanarVector& force_N) const {
    return touched(force_N, PlanarVector(test::solar().links[kBucket].length_m, 0));
  }
  Kinematics kinematics{test::solar()};
  ContactLaw law{test::solar()};
  estimation::JointState state;
};

TEST(ContactLaw, GivesWayWhereTheBucketIsTouchedAndNotAtItsTip) {
  const Bench bench;
  const PlanarVector force_N(-2000, 500);
  const double expected_m = force_N.norm() / test::solar().control.tip_stiffness_N_per_m;
  const BucketProfile& profile = test::solar().bucket_profile;
  for (const PlanarVector& at_m : {profile.heel_m, profile.back_m, profile.cheek_m}) {
    const Touch touch = bench.touched(force_N, at_m);
    const JointVector compliance_rad = bench.law.compliance_rad(touch);
    const double along_m = touch.normal.dot(bench.jacobian_at(at_m) * compliance_rad);
    EXPECT_NEAR(along_m, expected_m, 0.2 * expected_m) << at_m.transpose();
  }
}

TEST(ContactLaw, ASmallForceDoesNotSayWhereItActs) {
  const Bench bench;
  const Touch touch = bench.touched({-20, 0}, test::solar().bucket_profile.heel_m);
  EXPECT_NEAR((touch.jacobian - touch.tip_jacobian).norm(), 0, 0.02);
}

TEST(ContactLaw, PressesNoFurtherThanTheHandIsShownAndAMargin) {
  const Bench bench;
  const PlanarVector pushed_N(-5000, 0);
  const Touch touch = bench.at_tip(pushed_N);
  const JointVector lead_rad = bench.law.to_joints(touch.tip_jacobian) * PlanarVector(0.15, 0.05);
  const auto lead_m = [&](const PlanarVector& rendered_N, double contact_compliance = 0) {
    return PlanarVector(touch.tip_jacobian * bench.law.limited_lead_rad(lead_rad, touch, rendered_N, 1e6,
                                                                        bench.law.contact_probability(touch, 1e6),
                                                                        contact_compliance));
  };
  const double stiffness = test::solar().control.tip_stiffness_N_per_m,
               margin_N = test::solar().control.feed_forward_fade_N;
  for (const double rendered_N : {0.0, 1000.0, 4000.0}) {
    const double allowed_m = (rendered_N + margin_N) / stiffness;
    EXPECT_NEAR(lead_m({-rendered_N, 0}).x(), allowed_m, 0.1 * allowed_m) << rendered_N;
  }
  EXPECT_NEAR(lead_m({1000, 0}).x(), lead_m({0, 0}).x(), 1e-9) << "what is shown the other way allows nothing";
  const PlanarVector free_m = touch.tip_jacobian * lead_rad;
  EXPECT_NEAR(lead_m({-20e3, 0}).x(), free_m.x(), 1e-12);
  EXPECT_NEAR(lead_m({0, 0}, 1).x(), free_m.x(), 1e-12) << "soil goes along";
  EXPECT_EQ(bench.law.limited_lead_rad(-lead_rad, touch, {0, 0}, 1e6, 1, 0), JointVector(-lead_rad)) << "away is free";
  const Touch light = bench.at_tip({-300, 0});
  EXPECT_EQ(bench.law.limited_lead_rad(lead_rad, light, {0, 0}, 1e6, bench.law.contact_probability(light, 1e6), 0),
            lead_rad)
      << "nothing is touched";
}

TEST(ContactLaw, WhatIsNotTrustedIsNotPressedOnAsItIsNotGivenWayTo) {
  const Bench bench;
  const PlanarVector at_m(test::solar().links[kBucket].length_m, 0);
  double last_m = 1;
  for (const double confidence : {0.4, 0.3, 0.2, 0.1}) {
    const Touch touch = bench.touched({-5000, 0}, at_m, confidence);
    const JointVector lead_rad = bench.law.to_joints(touch.tip_jacobian) * PlanarVector(0.15, 0);
    const JointVector limited_lead_rad = bench.law.limited_lead_rad(lead_rad, touch, {-2000, 0}, 1e6, 1, 0);
    const double pressed_m = (touch.tip_jacobian * limited_lead_rad).x();
    EXPECT_LT(pressed_m, last_m) << confidence;
    last_m = pressed_m;
  }
  EXPECT_NEAR(last_m, 0, 1e-4);
  const Touch doubtful = bench.touched({-5000, 0}, at_m, 0.1);
  const JointVector lead_rad = bench.law.to_joints(doubtful.tip_jacobian) * PlanarVector(0.15, 0);
  EXPECT_NEAR((doubtful.tip_jacobian * bench.law.limited_lead_rad(lead_rad, doubtful, {-2000, 0}, 1e6, 1, 1)).x(), 0,
              1e-4)
      << "whether it moves along is not known either";
}

TEST(ContactLaw, NoiseInTheDirectionOfADoubtfulForceDoesNotSwitchTheWayAlongIt) {
  const Bench bench;
  const Touch touch = bench.touched({-2500, 0}, {test::solar().links[kBucket].length_m, 0}, 0.1);
  const auto along_m = [&](double pressing_m) {
    const JointVector lead_rad = bench.law.to_joints(touch.tip_jacobian) * PlanarVector(pressing_m, 0.15);
    return (touch.tip_jacobian * bench.law.limited_lead_rad(lead_rad, touch, {0, 0}, 1e6, 1, 0)).y();
  };
  double last_m = along_m(-0.005);
  for (double pressing_m = -0.005; pressing_m < 0.03; pressing_m += 1e-4) {
    EXPECT_NEAR(along_m(pressing_m), last_m, 0.01) << pressing_m;
    last_m = along_m(pressing_m);
  }
}

TEST(ContactLaw, WhatMovesAlongIsPressedNoHarderThanMayBePressed) {
  const Bench bench;
  const Touch touch = bench.at_tip({-5000, 0});
  const JointVector lead_rad = bench.law.to_joints(touch.tip_jacobian) * PlanarVector(0.15, 0.05);
  const double most_N = 3000, allowed_m = most_N / test::solar().control.tip_stiffness_N_per_m;
  for (const double contact_compliance : {0.5, 1.0}) {
    const JointVector limited_lead_rad = bench.law.limited_lead_rad(
        lead_rad, touch, {-8000, 0}, most_N, bench.law.contact_probability(touch, most_N), contact_compliance);
    EXPECT_NEAR((touch.tip_jacobian * limited_lead_rad).x(), allowed_m, 0.1 * 0.15) << contact_compliance;
  }
}

TEST(ContactLaw, SlowsTheTouchedPointExactlyAndNothingElseOfIt) {
  const Bench bench;
  const JointVector rate_radps(0.2, -0.4, 0.7);
  for (const PlanarVector& at_m :
       {PlanarVector(test::solar().links[kBucket].length_m, 0), test::solar().bucket_profile.heel_m}) {
    const Touch touch = bench.touched({-5000, 2000}, at_m);
    const PlanarVector less_mps(0.3, -0.1);
    const PlanarVector changed_mps =
        touch.jacobian * (rate_radps - bench.law.slowed_radps(rate_radps, touch, less_mps));
    EXPECT_NEAR((changed_mps - less_mps).norm(), 0, 1e-4);
  }
}

TEST(ContactLaw, DrawsBackBeyondWhatMayBePressedHoweverMuchTheHandIsShown) {
  const Bench bench;
  const Touch touch = bench.at_tip({-5000, 0});
  const JointVector lead_rad = bench.law.to_joints(touch.tip_jacobian) * PlanarVector(0.15, 0);
  const auto towards_mps = [&](double most_N) {
    const JointVector limited_lead_rad = bench.law.limited_lead_rad(lead_rad, touch, {-8000, 0}, most_N,
                                                                    bench.law.contact_probability(touch, most_N), 0);
    return (touch.tip_jacobian * (limited_lead_rad + bench.law.compliance_rad(touch))).x();
  };
  EXPECT_GT(towards_mps(6000), 0);
  EXPECT_LT(towards_mps(4000), 0);
}

/// Real parts of the eigenvalues, the smaller first. In closed form: Eigen's solver takes ten seconds to compile.
std::pair<double, double> eigenvalues_of(const Eigen::Matrix2d& matrix) {
  const double middle = matrix.trace() / 2;
  const double apart = std::sqrt(std::max(0.0, middle * middle - matrix.determinant()));
  return {middle - apart, middle + apart};
}

TEST(ContactLaw, CrossesOverNoFasterThanValvesAndFiltersAllow) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> share(0.1, 0.9);
  const BucketProfile& profile = test::solar().bucket_profile;
  const auto& control = test::solar().control;
  double fastest = 0, slowest = 1e9;
  for (std::size_t draw = 0; draw < 300; ++draw) {
    JointVector pose;
    for (int i = 0; i < kJoints; ++i) {
      const LinkDescription& link = test::solar().links[static_cast<std::size_t>(i)];
      pose[i] = link.min_rad + share(random) * (link.max_rad - link.min_rad);
    }
    const Bench bench(pose);
    const PlanarVector tip_m(test::solar().links[kBucket].length_m, 0);
    const Touch touch = bench.touched({-3000, 1000}, std::array{tip_m, profile.back_m, profile.heel_m}.at(draw % 3));
    JointVector oil_rad_per_Nm;
    for (int i = 0; i < kJoints; ++i) {
      const auto& cylinder = test::solar().cylinders[static_cast<std::size_t>(i)];
      const CylinderState at = *bench.kinematics.cylinder_at(i, pose[i]);
      oil_rad_per_Nm[i] =
          1 / (oil_stiffness_N_per_m(cylinder, test::solar().hydraulics, at.length_m) * at.lever_m * at.lever_m);
    }
    const Eigen::Matrix2d soft = touch.jacobian * oil_rad_per_Nm.asDiagonal() * touch.jacobian.transpose();
    // Rate that answers a force: along the loop it comes back as the oil's stiffness times that.
    Eigen::Matrix2d answer;
    for (int axis = 0; axis < 2; ++axis) {
      const JointVector rate = bench.law.to_joints(touch.jacobian) * PlanarVector::Unit(axis);
      answer.col(axis) = touch.jacobian * bench.law.steadied_radps(rate, touch, bench.state);
    }
    const Eigen::Matrix2d loop = soft.inverse() * answer;
    const double gain_m_per_Ns = control.position_gain_1ps / control.tip_stiffness_N_per_m;
    const double crossover = gain_m_per_Ns * eigenvalues_of(loop).second;
    const double unsteadied = gain_m_per_Ns / eigenvalues_of(soft).first;
    fastest = std::max(fastest, unsteadied);
    slowest = std::min(slowest, unsteadied);
    ASSERT_LT(crossover, 1.05 * control.contact_crossover_radps) << pose.transpose();
  }
  EXPECT_GT(fastest, 2.5 * control.contact_crossover_radps) << "poses in which there is something to do";
  EXPECT_LT(slowest, control.contact_crossover_radps) << "and some in which there is not";
}

TEST(ContactLaw, FreeMotionIsNotSlowed) {
  const Bench bench;
  const JointVector rate(0.3, -0.2, 0.5);
  EXPECT_NEAR((bench.law.steadied_radps(rate, bench.at_tip({0, 0}), bench.state) - rate).norm(), 0, 1e-12);
}

TEST(ContactLaw, SlowsWithoutTurningRound) {
  const Bench bench;
  const Touch touch = bench.touched({-3000, 0}, test::solar().bucket_profile.back_m);
  for (const PlanarVector& way_mps : {PlanarVector(0.1, 0), PlanarVector(0, 0.1), PlanarVector(-0.05, 0.08)}) {
    const JointVector rate = bench.law.to_joints(touch.jacobian) * way_mps;
    const PlanarVector before = touch.jacobian * rate;
    const PlanarVector after = touch.jacobian * bench.law.steadied_radps(rate, touch, bench.state);
    EXPECT_GT(after.dot(before), 0);
    EXPECT_LE(after.norm(), before.norm() * 1.01);
  }
}

TEST(ContactLaw, WhatAnEndStopTakesOfAJointsTorqueIsNoForceToGiveWayTo) {
  const Bench bench;
  estimation::ForceEstimate force;
  force.confidence = 0.5;
  force.fast_torque_Nm = JointVector(0, 0, 400);  // the bucket is pressed against its stop
  const PlanarVector believed_N = bench.law.touch(bench.state, force).force_N;
  ASSERT_GT(believed_N.norm(), 100);
  force.measurement_variance_Nm2 = JointVector(100, 100, std::pow(1e5 * bench.state.lever_m[kBucket], 2));
  EXPECT_LT(bench.law.touch(bench.state, force).force_N.norm(), 0.05 * believed_N.norm());
  // Free motion and standing friction of all joints take nothing from a force.
  force.fast_torque_Nm = bench.kinematics.tip_jacobian(kPressing).transpose() * PlanarVector(-1500, 400);
  force.measurement_variance_Nm2 = (300 * bench.state.lever_m).cwiseAbs2();
  const PlanarVector pressed_N = bench.law.touch(bench.state, force).force_N;
  EXPECT_NEAR((pressed_N - PlanarVector(-1500, 400)).norm(), 0, 0.1 * pressed_N.norm());
}

// Of a bucket that is curled in, with a lever of 16 mm, the lever is what is uncertain, and its torque no surer than
// through 5 cm.
TEST(ContactLaw, AJointWithAShortLeverCountsAsMuchAsOthersForWhatFrictionLeaves) {
  const Bench curled({kPressing[kBoom], kPressing[kArm], test::solar().links[kBucket].min_rad});
  ASSERT_LT(std::abs(curled.state.lever_m[kBucket]), 0.4 * kLeastSureLever_m);
  estimation::ForceEstimate force;
  force.fast_torque_Nm = curled.kinematics.tip_jacobian(curled.state.angle_rad).transpose() * PlanarVector(-1500, 400);
  const PlanarVector sure_N = curled.law.touch(curled.state, force).force_N;
  ASSERT_GT(sure_N.norm(), 1000);
  force.measurement_variance_Nm2 = (900 * curled.state.lever_m.cwiseAbs().cwiseMax(kLeastSureLever_m)).cwiseAbs2();
  EXPECT_EQ(curled.law.touch(curled.state, force).force_N, sure_N);
}

TEST(ContactLaw, TheQuickerOfTheGainsSaysHowFastItCrossesOver) {
  MachineDescription quick = test::solar();
  quick.control.bucket_position_gain_1ps *= 2;
  const Bench bench;
  const Touch touch = bench.touched({-3000, 0}, test::solar().bucket_profile.back_m);
  const JointVector rate_radps = JointVector::Constant(0.1);
  const double usual = (touch.jacobian * bench.law.steadied_radps(rate_radps, touch, bench.state)).norm();
  EXPECT_LT((touch.jacobian * ContactLaw(quick).steadied_radps(rate_radps, touch, bench.state)).norm(), 0.9 * usual);
}

}  // namespace
}  // namespace knuckle::slave
