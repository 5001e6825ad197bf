// A torque that is not known has no say: whatever stands in its place changes nothing, and what is told rests on the
// others, as sure as they let it be.
#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <random>

#include "estimation/contact_models.h"
#include "estimation/tip_force.h"
#include "machine/kinematics.h"
#include "tests/estimation/test_machine.h"
#include "tests/estimation/twin.h"

namespace knuckle::estimation {
namespace {

Eigen::Matrix3d covariance(int missing) {
  Eigen::Matrix3d c = kSigma_Nm.cwiseAbs2().asDiagonal();
  c(0, 1) = c(1, 0) = 200;
  c(1, 2) = c(2, 1) = 60;
  c(missing, missing) = kUnknownVariance;
  return c;
}

TEST(TorqueWeight, IsTheInverseOfWhatIsKnownAndNothingElse) {
  for (int missing = 0; missing < kJoints; ++missing) {
    const Eigen::Matrix3d c = covariance(missing), weight = torque_weight(c);
    const int a = missing == 0 ? 1 : 0, b = missing == 2 ? 1 : 2;
    Eigen::Matrix2d block;
    block << c(a, a), c(a, b), c(b, a), c(b, b);
    const Eigen::Matrix2d inverse = block.inverse();
    EXPECT_NEAR(weight(a, a), inverse(0, 0), 1e-12);
    EXPECT_NEAR(weight(a, b), inverse(0, 1), 1e-12);
    EXPECT_NEAR(weight(b, b), inverse(1, 1), 1e-12);
    EXPECT_EQ(weight.row(missing).norm(), 0);
    EXPECT_EQ(weight.col(missing).norm(), 0);
  }
}

TEST(MissingTorque, LeavesTheForceOfTheTwoOthersExactly) {
  const MachineDescription machine = test_machine();
  const PlanarJacobian jacobian = Kinematics(machine).tip_jacobian(kBent);
  const PlanarVector force_N(-900, 1400);
  for (int missing = 0; missing < kJoints; ++missing) {
    JointVector torque = jacobian.transpose() * force_N;
    torque[missing] = 7e4;
    const TipForce found = solve_tip_force(jacobian, torque, covariance(missing));
    EXPECT_LT((found.force_N - force_N).norm(), 0.01 * force_N.norm()) << missing;
    EXPECT_TRUE(found.covariance_N2.allFinite());
    EXPECT_LT(found.residual_sigma, 0.2) << missing << ": two torques always agree";
  }
}

// A place on the bucket shifts the force by what the pose makes of it, without end where arm and bucket are in line.
TEST(MissingTorque, NearAPoseThatDoesNotTellNoForceIsMadeOfNoise) {
  const MachineDescription machine = test_machine();
  const BucketForceModel model(machine);
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  for (double bucket = -0.06; bucket <= 0.06; bucket += 0.001) {
    const JointVector pose(0.7, -1.8, bucket), torque_Nm(0, 20 * normal(random), 5 * normal(random));
    Eigen::Matrix3d c = JointVector(40, 12, 4).cwiseAbs2().asDiagonal();
    c(kBoom, kBoom) = kUnknownVariance;
    const BucketLoad load = model.solve(pose, Kinematics(machine).tip_jacobian(pose), torque_Nm, c);
    const double sigma_N = largest_sigma(load.covariance_N2);
    EXPECT_LT(load.force_N.norm(), 20e3) << bucket;
    EXPECT_LT(load.force_N.norm(), 4 * sigma_N) << bucket;
    EXPECT_LT(sigma_N, 40e3) << bucket;
  }
}

// Where the bucket touches is not seen any more: that must be in the interval.
TEST(MissingTorque, MakesTheIntervalIncludeThePlaceOnTheBucket) {
  const MachineDescription machine = machine_with_outline();
  const BucketForceModel model(machine);
  const Kinematics kinematics(machine);
  const BucketProfile& profile = machine.bucket_profile;
  const PlanarVector tip(machine.links[kBucket].length_m, 0);
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  int within = 0, at_tip_within = 0;
  constexpr int kDraws = 3000;
  for (int k = 0; k < kDraws; ++k) {
    const JointVector joints(0.9 * uniform(random) - 0.2, -2.0 + 1.2 * uniform(random), -1.8 + 1.4 * uniform(random));
    const PlanarVector place = k % 2 == 0 ? tip : PlanarVector(tip + uniform(random) * (profile.heel_m - tip));
    // Pushes: against the outward normals of teeth and floor, within friction.
    const double way = joints.sum() + std::numbers::pi + (0.9 * uniform(random) - 0.1) * std::numbers::pi / 2;
    const PlanarVector force_N = 200 * std::exp(3 * uniform(random)) * PlanarVector(std::cos(way), std::sin(way));
    const PlanarVector shift = Eigen::Rotation2Dd(joints.sum()) * (place - tip);
    const PlanarJacobian jacobian = kinematics.tip_jacobian(joints);
    const JointVector torque = jacobian.transpose() * force_N + JointVector::Constant(cross(shift, force_N)) +
                               JointVector(0, 25 * normal(random), 10 * normal(random));
    Eigen::Matrix3d c = kSigma_Nm.cwiseAbs2().asDiagonal();
    c(kBoom, kBoom) = kUnknownVariance;
    const auto covered = [&](const BucketLoad& found) {
      const PlanarVector error_N = found.force_N - force_N;
      return error_N.dot(found.covariance_N2.inverse() * error_N) < 5.99;
    };
    within += covered(model.solve(joints, jacobian, torque, c));
    at_tip_within += covered(model.at_tip(joints, jacobian, torque, c));
  }
  EXPECT_GT(within, 0.9 * kDraws) << within;
  EXPECT_GT(at_tip_within, 0.9 * kDraws) << at_tip_within;
}

// A corner in line with the arm: along it no force is told there, but what acts at the tip is told well.
TEST(MissingTorque, NoiseIsNoForceWhereACornerOfTheBucketIsInLineWithTheArm) {
  const MachineDescription machine = machine_with_outline();
  const BucketForceModel model(machine);
  const Kinematics kinematics(machine);
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  Eigen::Matrix3d c = kSigma_Nm.cwiseAbs2().asDiagonal();
  c(kBoom, kBoom) = kUnknownVariance;
  for (const PlanarVector& corner :
       {machine.bucket_profile.edge_m, machine.bucket_profile.heel_m, machine.bucket_profile.back_m}) {
    const JointVector joints(0.3, -1.5, -std::atan2(corner.y(), corner.x()));
    const PlanarJacobian jacobian = kinematics.tip_jacobian(joints);
    double most_N = 0, most_at_tip_N = 0;
    for (int k = 0; k < 300; ++k) {
      const JointVector torque(0, 25 * normal(random), 10 * normal(random));
      most_N = std::max(most_N, model.solve(joints, jacobian, torque, c).force_N.norm());
      most_at_tip_N = std::max(most_at_tip_N, model.at_tip(joints, jacobian, torque, c).force_N.norm());
    }
    EXPECT_LT(most_N, 1.5 * most_at_tip_N) << corner.transpose();
  }
}

TEST(MissingTorque, IsNotFeltWhateverStandsInItsPlace) {
  for (int missing = 0; missing < kJoints; ++missing) {
    Twin zeros(real_sensors()), wild(real_sensors());
    zeros.pressures_known[static_cast<std::size_t>(missing)] = wild.pressures_known[static_cast<std::size_t>(missing)] =
        false;
    wild.unmeasured_Pa = std::numeric_limits<double>::quiet_NaN();
    for (int n = 0; n < 6000; ++n) {
      const PlanarVector push_N = n > 5000 ? PlanarVector(-900, 600) : PlanarVector::Zero();
      const ForceEstimate& a = zeros.step(push_N);
      const ForceEstimate& b = wild.step(push_N);
      ASSERT_EQ(a.tip_N, b.tip_N) << missing << ", step " << n;
      ASSERT_EQ(a.contact, b.contact);
    }
    const ForceEstimate& e = zeros.estimator().estimate();
    EXPECT_TRUE(e.confidence_reasons & kTorqueMissing);
    EXPECT_EQ(e.joint_torque_Nm[missing], 0);
    EXPECT_TRUE(e.tip_N.allFinite());
    EXPECT_TRUE(e.covariance_N2.allFinite());
  }
}

int contacts_at_start(const PerJoint<bool>& known) {
  Twin twin(real_sensors());
  twin.pressures_known = known;
  int contacts = 0;
  for (int n = 0; n < 400; ++n) contacts += twin.step(PlanarVector::Zero()).contact;
  return contacts;
}

// The step from nothing to a torque that nobody measures is none: the boom's is kilonewton metres.
TEST(MissingTorque, IsNoContactAtTheStart) {
  EXPECT_EQ(contacts_at_start({false, true, true}), 0);
  EXPECT_EQ(contacts_at_start({true, false, true}), 0);
}

TEST(MissingTorque, FreeMotionAndAKnownForceAreToldByTheTwoOthersWithinTheirInterval) {
  for (int missing = 0; missing < kJoints; ++missing) {
    Twin twin(real_sensors());
    twin.pressures_known[static_cast<std::size_t>(missing)] = false;
    int covered = 0, looks = 0, contacts = 0;
    for (int n = 0; n < 8000; ++n) {
      const ForceEstimate& e = twin.step(PlanarVector::Zero());
      if (n < 4000 || n % 20 != 0) continue;
      ++looks;
      contacts += e.contact;
      covered += e.tip_N.dot(e.covariance_N2.inverse() * e.tip_N) < 5.99;
    }
    EXPECT_GT(covered, 0.9 * looks) << missing;
    EXPECT_LT(contacts, 0.02 * looks) << missing;
    EXPECT_EQ(twin.estimator().estimate().confidence_reasons & kBiasNotLearned, 0);
    const PlanarVector push_N(-1500, 1200);
    for (int n = 0; n < 200; ++n) twin.step(push_N, 0.3);
    const ForceEstimate& e = twin.estimator().estimate();
    const PlanarVector error_N = e.tip_N - push_N;
    EXPECT_TRUE(e.contact) << missing;
    EXPECT_LT(error_N.dot(e.covariance_N2.inverse() * error_N), 9.2) << missing << ": " << error_N.transpose();
  }
}

// Twelve hours of free air: what is learned of the missing torque neither fades to nothing nor grows.
TEST(MissingTorque, LeavesItsSpreadAsItWas) {
  FreeSpread spread(JointVector(100, 100, 100), BiasFilter::kUpdateEvery_s);
  const double before_Nm2 = spread.covariance_Nm2()(kBoom, kBoom);
  const double least_s = 12 * 3600;
  for (double t = 0; t < least_s; t += BiasFilter::kUpdateEvery_s)
    spread.update({0, 5, -5}, {10, 10, 10}, {kUnknownVariance, 1, 1});
  EXPECT_NEAR(spread.covariance_Nm2()(kBoom, kBoom), before_Nm2, 1e-9);
  EXPECT_TRUE(spread.covariance_Nm2().allFinite());
}

}  // namespace
}  // namespace knuckle::estimation
