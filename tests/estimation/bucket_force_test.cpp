// One force anywhere on the bucket, from three joint torques: found wherever it acts, as sure as it says, and at the
// tip within a hundredth of what it is.
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "estimation/tip_force.h"
#include "machine/kinematics.h"
#include "tests/estimation/test_machine.h"

namespace knuckle::estimation {
namespace {

struct Arm {
  MachineDescription machine = machine_with_outline();
  Kinematics kinematics{machine};
  BucketForceModel model{machine};

  /// Of a force at a place of the bucket, bucket axes.
  JointVector torque(const JointVector& joints_rad, const PlanarVector& force_N, const PlanarVector& place_m) const {
    const Eigen::Rotation2Dd turn(joints_rad.sum());
    const PlanarVector shift = turn * (place_m - PlanarVector(machine.links[kBucket].length_m, 0));
    const double couple = shift.x() * force_N.y() - shift.y() * force_N.x();
    return kinematics.tip_jacobian(joints_rad).transpose() * force_N + JointVector::Constant(couple);
  }
  BucketLoad solve(const JointVector& joints_rad, const JointVector& torque_Nm) const {
    return model.solve(joints_rad, kinematics.tip_jacobian(joints_rad), torque_Nm, kCovariance_Nm2);
  }
  double couple_Nm(const JointVector& joints_rad, const JointVector& torque_Nm) const {
    return model.couple_Nm(joints_rad, kinematics.tip_jacobian(joints_rad), torque_Nm, kCovariance_Nm2);
  }
};

TEST(BucketForce, IsFoundWhereverOnTheBucketItActs) {
  const Arm arm;
  const BucketProfile& profile = arm.machine.bucket_profile;
  for (const PlanarVector& place : {profile.edge_m, profile.heel_m, profile.back_m, profile.cheek_m}) {
    for (double way = 0; way < 6.2; way += 0.3) {
      const PlanarVector force_N = 5000 * PlanarVector(std::cos(way), std::sin(way));
      const BucketLoad found = arm.solve(kBent, arm.torque(kBent, force_N, place));
      EXPECT_LT((found.force_N - force_N).norm(), 0.05 * force_N.norm()) << place.transpose() << ", " << way;
      EXPECT_LT(found.residual_sigma, 4);
    }
  }
}

TEST(BucketForce, AtTheTipIsFoundWithinAHundredthAndWithinThreeSigma) {
  const Arm arm;
  const PlanarVector tip(arm.machine.links[kBucket].length_m, 0);
  for (double way = 0; way < 6.2; way += 0.3) {
    const PlanarVector force_N = 1000 * PlanarVector(std::cos(way), std::sin(way));
    const BucketLoad found = arm.solve(kBent, arm.torque(kBent, force_N, tip));
    const PlanarVector error_N = found.force_N - force_N;
    EXPECT_LT(error_N.norm(), 10) << way;
    EXPECT_LT(error_N.dot(found.covariance_N2.inverse() * error_N), 9) << way;
    EXPECT_LT(std::abs(arm.couple_Nm(kBent, arm.torque(kBent, force_N, tip))), 1);
  }
  const BucketLoad nothing = arm.solve(kBent, JointVector(5, -3, 2));
  const TipForce at_tip = solve_tip_force(arm.kinematics.tip_jacobian(kBent), JointVector(5, -3, 2), kCovariance_Nm2);
  EXPECT_LT((nothing.force_N - at_tip.force_N).norm(), 3);
}

// Presses of a wall on tip, heel and back, along a normal of that corner and within friction. Torques alone, without a
// thought to what can touch, leave 36, 40 and 40 N.
TEST(BucketForce, IsNearerWhereACornerCanOnlyBePushedAlongItsNormals) {
  const Arm arm;
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  const auto evenly = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const BucketProfile& profile = arm.machine.bucket_profile;
  struct Corner {
    PlanarVector at_m;
    double low_deg, high_deg;  // outward normals
    double error_N;
  };
  const PlanarVector tip(arm.machine.links[kBucket].length_m, 0);
  for (const Corner& corner :
       {Corner{tip, -88, 50, 29}, {profile.heel_m, 54, 92, 34}, {profile.back_m, 93, 173, 38.5}}) {
    double squares_N2 = 0;
    constexpr int kDraws = 1000;
    for (int k = 0; k < kDraws; ++k) {
      const double way = (evenly(corner.low_deg, corner.high_deg) + 180 + evenly(-20, 20)) * std::numbers::pi / 180;
      const PlanarVector force_N = 2000 * PlanarVector(std::cos(way + kBent.sum()), std::sin(way + kBent.sum()));
      const JointVector noise(40 * normal(random), 25 * normal(random), 10 * normal(random));
      const BucketLoad found = arm.solve(kBent, arm.torque(kBent, force_N, corner.at_m) + noise);
      squares_N2 += (found.force_N - force_N).squaredNorm() / kDraws;
    }
    EXPECT_LT(std::sqrt(squares_N2), corner.error_N) << corner.at_m.transpose();
  }
}

TEST(BucketForce, ErrorsAreWithinWhatTheCovarianceSays) {
  const Arm arm;
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const BucketProfile& profile = arm.machine.bucket_profile;
  const PlanarVector tip(arm.machine.links[kBucket].length_m, 0);
  int within = 0;
  constexpr int kDraws = 4000;
  for (int k = 0; k < kDraws; ++k) {
    const JointVector joints(0.9 * uniform(random) - 0.2, -2.0 + 1.2 * uniform(random), -1.8 + 1.8 * uniform(random));
    const double size_N = 200 * std::exp(3.5 * uniform(random)), way = 2 * std::numbers::pi * uniform(random);
    const PlanarVector force_N = size_N * PlanarVector(std::cos(way), std::sin(way));
    const PlanarVector place = k % 2 == 0 ? tip : PlanarVector(tip + uniform(random) * (profile.heel_m - tip));
    const JointVector noise(40 * normal(random), 25 * normal(random), 10 * normal(random));
    const BucketLoad found = arm.solve(joints, arm.torque(joints, force_N, place) + noise);
    const PlanarVector error_N = found.force_N - force_N;
    within += error_N.dot(found.covariance_N2.inverse() * error_N) < 5.99;  // 95 % of chi squared with two degrees
  }
  EXPECT_GT(within, 0.9 * kDraws);
  EXPECT_LT(within, 0.99 * kDraws);
}

// A hit on the boom or the arm is what a force through the bucket's pin would be, along the arm or towards the boom's
// pin. A force that passes the bucket is none of the world on it.
TEST(BucketForce, AForceWhoseLinePassesTheBucketLeavesAResidual) {
  const Arm arm;
  for (double way = 0; way < 6.2; way += 0.3) {
    const PlanarVector force_N = 1500 * PlanarVector(std::cos(way), std::sin(way));
    const PlanarVector aside = Eigen::Rotation2Dd(-kBent.sum()) * PlanarVector(-force_N.y(), force_N.x()).normalized();
    for (const double by_m : {1.2, -1.2}) {
      EXPECT_GT(arm.solve(kBent, arm.torque(kBent, force_N, by_m * aside)).residual_sigma, 4) << way << ", " << by_m;
    }
  }
}

}  // namespace
}  // namespace knuckle::estimation
