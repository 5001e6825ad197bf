// The contact models against forces put in by hand: what they find, how sure they are, and what they refuse.
#include "estimation/contact_models.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "tests/estimation/test_machine.h"

namespace knuckle::estimation {
namespace {

JointVector lengths() {
  return {1.75, 0.95, 0.5};
}

/// Joint torques of a force at a point of the bucket (distance from its joint along its x axis) and a torque on it.
JointVector torques(const JointVector& joint_rad, const PlanarVector& force_N, double place_m, double torque_Nm = 0) {
  JointVector result;
  PlanarVector from_joint = PlanarVector::Zero();
  const JointVector length(lengths()[0], lengths()[1], place_m);
  double angle = joint_rad.sum();
  for (int i = kBucket; i >= 0; --i) {
    from_joint += length[i] * PlanarVector(std::cos(angle), std::sin(angle));
    result[i] = from_joint.x() * force_N.y() - from_joint.y() * force_N.x() + torque_Nm;
    angle -= joint_rad[i];
  }
  return result;
}

JointLoad load_of(const JointVector& torque_Nm, const JointVector& joint_rad = kBent) {
  JointLoad load;
  load.joint_rad = joint_rad;
  load.lever_m = JointVector(0.2, -0.2, -0.1);
  load.torque_Nm = torque_Nm;
  load.covariance_Nm2 = JointVector(900, 400, 100).asDiagonal();
  return load;
}

/// Share of noisy torques whose answer lies within the 95 % ellipse of its own covariance.
template <typename Ask>
double coverage(const JointVector& torque_Nm, const Eigen::VectorXd& truth, double chi2_95, Ask ask) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  int inside = 0;
  constexpr int kDraws = 4000;
  for (int n = 0; n < kDraws; ++n) {
    const JointVector noise(30 * normal(random), 20 * normal(random), 10 * normal(random));
    const auto [answer, covariance] = ask(load_of(torque_Nm + noise));
    const Eigen::VectorXd error = answer - truth;
    if (error.dot(covariance.inverse() * error) < chi2_95) ++inside;
  }
  return static_cast<double>(inside) / kDraws;
}

ContactRefusal refusal(const auto& answer) {
  EXPECT_TRUE(std::holds_alternative<ContactRefusal>(answer));
  return std::get<ContactRefusal>(answer);
}

TEST(TipWrench, FindsForceAndTorqueAndTheirSpread) {
  const Eigen::Vector3d truth(-1200, 800, 150);
  const JointVector torque = torques(kBent, truth.head<2>(), lengths()[2], truth[2]);
  EXPECT_LT((std::get<TipWrench>(tip_wrench(lengths(), load_of(torque))).wrench - truth).norm(), 1e-6);
  EXPECT_NEAR(coverage(torque, truth, 7.815,
                       [](const JointLoad& load) {
                         const auto found = std::get<TipWrench>(tip_wrench(lengths(), load));
                         return std::pair<Eigen::VectorXd, Eigen::MatrixXd>(found.wrench, found.covariance);
                       }),
              0.95, 0.015);
}

TEST(TipWrench, RefusesAStraightArmAndABucketNearItsToggle) {
  EXPECT_EQ(refusal(tip_wrench(lengths(), load_of(JointVector(100, 50, 20), {0.3, 0.05, -0.9}))),
            ContactRefusal::kStraightArm);
  JointLoad toggle = load_of(JointVector(100, 50, 20));
  toggle.lever_m[kBucket] = 0.005;
  EXPECT_EQ(refusal(tip_wrench(lengths(), toggle)), ContactRefusal::kNearToggle);
}

TEST(ForceOfTwoJoints, FindsForceAndDirectionAndTheirSpreadWithoutTheBoom) {
  const PlanarVector truth(-900, -1500);
  JointVector torque = torques(kBent, truth, 0.4);
  torque[kBoom] += 5000;  // something leans on the boom
  EXPECT_LT((std::get<TwoJointForce>(tip_force_of_two(lengths(), load_of(torque), 0.4)).force_N - truth).norm(), 1e-6);
  EXPECT_NEAR(coverage(torque, truth, 5.991,
                       [](const JointLoad& load) {
                         const auto found = std::get<TwoJointForce>(tip_force_of_two(lengths(), load, 0.4));
                         return std::pair<Eigen::VectorXd, Eigen::MatrixXd>(found.force_N, found.covariance_N2);
                       }),
              0.95, 0.015);
}

TEST(ForceOfTwoJoints, RefusesABucketInLineWithTheArmAndAPlaceAtItsJointOrBeyondItsEnd) {
  EXPECT_EQ(refusal(tip_force_of_two(lengths(), load_of(JointVector(100, 50, 20), {0.3, -1.5, 0.02}), 0.5)),
            ContactRefusal::kBucketInLine);
  for (const double place : {-0.1, 0.01, 0.24, 1.26}) {
    const double place_m = place * lengths()[kBucket];
    EXPECT_EQ(refusal(tip_force_of_two(lengths(), load_of(JointVector(100, 50, 20)), place_m)),
              ContactRefusal::kOffTheBucket)
        << place;
  }
}

TEST(ForceAndPosition, FindsSizeAndPlaceOfAForceOfKnownDirection) {
  const PlanarVector direction = PlanarVector(-1, 0.2).normalized();
  const JointVector torque = torques(kBent, 2500 * direction, 0.35);
  const auto found = std::get<ForceAtPlace>(force_and_position(lengths(), load_of(torque), 3 * direction));
  EXPECT_NEAR(found.force_N, 2500, 1e-6);
  EXPECT_NEAR(found.place_m, 0.35, 1e-9);
  EXPECT_NEAR(coverage(torque, Eigen::Vector2d(2500, 0.35), 5.991,
                       [&](const JointLoad& load) {
                         const auto at = std::get<ForceAtPlace>(force_and_position(lengths(), load, direction));
                         return std::pair<Eigen::VectorXd, Eigen::MatrixXd>(Eigen::Vector2d(at.force_N, at.place_m),
                                                                            at.covariance);
                       }),
              0.95, 0.015);
}

TEST(ForceAndPosition, RefusesWhatHasNoPlace) {
  const double arm_rad = kBent[0] + kBent[1];
  const PlanarVector down(0, -1), along_arm(std::cos(arm_rad), std::sin(arm_rad));
  EXPECT_EQ(refusal(force_and_position(lengths(), load_of(torques(kBent, 2000 * along_arm, 0.4)), along_arm)),
            ContactRefusal::kDirectionAlongLink);
  const PlanarVector ahead(1, 0);
  EXPECT_EQ(refusal(force_and_position(lengths(), load_of(torques(kBent, 10 * ahead, 0.4)), ahead)),
            ContactRefusal::kForceTooSmall);
  EXPECT_EQ(refusal(force_and_position(lengths(), load_of(torques(kBent, 2000 * ahead, 1.5)), ahead)),
            ContactRefusal::kOffTheBucket);
  EXPECT_EQ(refusal(force_and_position(lengths(), load_of(JointVector(1, 1, std::numeric_limits<double>::quiet_NaN())),
                                       down)),
            ContactRefusal::kNotFinite);
  EXPECT_EQ(refusal(force_and_position(lengths(), load_of(JointVector(1, 1, 1)), PlanarVector::Zero())),
            ContactRefusal::kNotFinite);
}

}  // namespace
}  // namespace knuckle::estimation
