// Contact models in the running estimator: each tells a known force, what one refuses fades and comes back without a
// jump, and where on the bucket a force acts is told as surely as it is seen.
#include "estimation/contact_force.h"

#include <gtest/gtest.h>

#include <numbers>
#include <numeric>
#include <random>

#include "estimation/line_of_action.h"
#include "machine/kinematics.h"
#include "tests/estimation/test_machine.h"
#include "tests/estimation/twin.h"

namespace knuckle::estimation {
namespace {

MachineDescription machine_with(ContactModel model, ForceDirection direction = ForceDirection::kFixed,
                                const PlanarVector& fixed = {-1, 0.2}) {
  MachineDescription machine = machine_with_outline();
  machine.force = {model, direction, fixed};
  return machine;
}

struct Bench {
  explicit Bench(const MachineDescription& m) : machine(m), kinematics(m), force(m, kStep_s) {}
  ContactPose pose(const JointVector& joints_rad) const {
    ContactPose pose;
    pose.joints_rad = joints_rad;
    pose.jacobian = kinematics.tip_jacobian(joints_rad);
    for (int i = 0; i < kJoints; ++i) pose.lever_m[i] = kinematics.cylinder_at(i, joints_rad[i])->lever_m;
    return pose;
  }
  /// Of a force at a place of the bucket, bucket axes.
  JointVector torque(const JointVector& joints_rad, const PlanarVector& force_N, const PlanarVector& place_m) const {
    const PlanarVector shift =
        Eigen::Rotation2Dd(joints_rad.sum()) * (place_m - PlanarVector(machine.links[kBucket].length_m, 0));
    return kinematics.tip_jacobian(joints_rad).transpose() * force_N + JointVector::Constant(cross(shift, force_N));
  }
  const ContactAnswer& step(const ContactPose& pose, const JointVector& torque_Nm,
                            const Eigen::Matrix3d& covariance_Nm2 = kCovariance_Nm2) {
    force.step(pose, torque_Nm, torque_Nm, covariance_Nm2);
    return force.answer();
  }
  PlanarVector tip() const { return {machine.links[kBucket].length_m, 0}; }

  MachineDescription machine;
  Kinematics kinematics;
  ContactForce force;
};

TEST(ContactModels, OfAWeightHangsPlumbWhereverTheHullLeans) {
  Bench bench(machine_with(ContactModel::kForceAndPosition, ForceDirection::kPlumb));
  ContactPose pose = bench.pose(kBent);
  pose.hull_pitch_rad = 0.1;
  const PlanarVector weight_N = 900 * PlanarVector(-std::sin(0.1), -std::cos(0.1));
  const ContactAnswer& answer = bench.step(pose, bench.torque(kBent, weight_N, bench.tip()));
  EXPECT_FALSE(answer.refusal);
  EXPECT_LT((answer.load.force_N - weight_N).norm(), 1e-6);
}

TEST(ContactModels, AgainstTheMotionHaveNoDirectionBeforeTheFirstOneAndKeepItAtRest) {
  Bench bench(machine_with(ContactModel::kForceAndPosition, ForceDirection::kAgainstMotion));
  ContactPose pose = bench.pose(kBent);
  const PlanarVector force_N(-1500, 0);
  const auto step = [&]() -> const ContactAnswer& {
    return bench.step(pose, bench.torque(kBent, force_N, bench.tip()));
  };
  EXPECT_EQ(step().refusal, ContactRefusal::kNoDirection);
  EXPECT_EQ(step().share, 0);
  pose.tip_mps = {0.2, 0};
  for (int n = 0; n < 200; ++n) step();
  pose.tip_mps.setZero();
  EXPECT_FALSE(step().refusal);
  EXPECT_EQ(step().share, 1);
  EXPECT_LT((step().load.force_N - force_N).norm(), 1e-6);
}

// The arm goes through a pose that the model refuses: what is told of the force never jumps.
TEST(ContactModels, FadeWhereTheyRefuseAndComeBackWithoutAJump) {
  struct Case {
    ContactModel model;
    int joint;  // that goes through 0
  };
  for (const Case& c : {Case{ContactModel::kTipWrench, kArm}, Case{ContactModel::kTipForceOfTwo, kBucket}}) {
    Bench bench(machine_with(c.model));
    const PlanarVector force_N(-800, 900);
    PlanarVector before = force_N;
    int refused = 0, changes = 0;
    bool was = false;
    double least = 1;
    for (int n = 0; n < 2000; ++n) {
      JointVector joints = kBent;
      joints[c.joint] = -0.5 + 0.5 * n / 1000.0 + 2e-3 * std::sin(n);  // shaken where it begins to refuse
      const ContactPose pose = bench.pose(joints);
      const ContactAnswer& answer = bench.step(pose, bench.torque(joints, force_N, bench.tip()));
      const PlanarVector told = answer.share * answer.load.force_N;
      EXPECT_LT((told - before).norm(), 1.5 * force_N.norm() * kStep_s / ContactForce::kFade_s) << n;
      before = told;
      refused += answer.refusal.has_value();
      changes += answer.refusal.has_value() != was;
      was = answer.refusal.has_value();
      least = std::min(least, answer.share);
    }
    EXPECT_EQ(least, 0) << name(c.model);
    EXPECT_GT(refused, 200);
    EXPECT_EQ(changes, 2) << name(c.model) << ": neither shaken off nor on";
  }
}

TEST(ContactModels, WithoutATorqueThatTheyNeedAnswerAsTheBucketForceDoes) {
  Bench wrench(machine_with(ContactModel::kTipWrench)), bucket(machine_with(ContactModel::kBucketForce));
  Eigen::Matrix3d missing = kCovariance_Nm2;
  missing(kBoom, kBoom) = kUnknownVariance;
  const ContactPose pose = wrench.pose(kBent);
  const JointVector torque = wrench.torque(kBent, {-900, 400}, wrench.tip());
  const BucketLoad a = wrench.step(pose, torque, missing).load;
  const BucketLoad b = bucket.step(pose, torque, missing).load;
  EXPECT_EQ(a.force_N, b.force_N);
}

// Across its direction this model sees nothing. What limits the machine's force does.
TEST(ContactModels, LeaveTheLimitsAllThatTheTorquesTell) {
  Twin twin(real_sensors(), 1, machine_with(ContactModel::kForceAndPosition, ForceDirection::kFixed, {1, 0}));
  twin.free_motion(25);
  const PlanarVector across_N(0, -4000);
  for (int n = 0; n < 400; ++n) twin.step(across_N, 0.1);
  const ForceEstimate& e = twin.estimator().estimate();
  const PlanarJacobian jacobian = Kinematics(test_machine()).tip_jacobian(twin.angle_rad);
  const TipForce fast = solve_tip_force(jacobian, e.fast_torque_Nm, kCovariance_Nm2);
  EXPECT_LT((fast.force_N - across_N).norm(), 0.12 * across_N.norm());
}

// Live, with each model: the same known force, in the hand's channel and in the one that the machine's law follows.
TEST(ContactModels, LiveTellTheHandAndTheLawTheSameForce) {
  for (const ContactModel model : {ContactModel::kBucketForce, ContactModel::kTipWrench, ContactModel::kTipForceOfTwo,
                                   ContactModel::kForceAndPosition}) {
    const PlanarVector push_N(-1500, 300);
    Twin twin(real_sensors(), 1, machine_with(model));
    twin.free_motion(25);
    for (int n = 0; n < 400; ++n) twin.step(push_N, 0.1);
    const ForceEstimate& e = twin.estimator().estimate();
    EXPECT_EQ(e.contact_model, model);
    EXPECT_LT((e.tip_N - push_N).norm(), 0.12 * push_N.norm()) << name(model) << ": " << e.tip_N.transpose();
    const PlanarJacobian jacobian = Kinematics(test_machine()).tip_jacobian(twin.angle_rad);
    const TipForce fast = solve_tip_force(jacobian, e.fast_torque_Nm, kCovariance_Nm2);
    EXPECT_LT((fast.force_N - push_N).norm(), 0.12 * push_N.norm()) << name(model) << ": " << fast.force_N.transpose();
    EXPECT_GT(e.confidence, 0.4) << name(model) << ": " << doubt_text(e.confidence_reasons);
  }
}

// The torque about the tip, and the line on which the force acts.

TEST(LineOfAction, PassesTheTipWhereTheForceDoes) {
  BucketLoad load;
  load.force_N = {300, 400};
  load.covariance_N2 = 100 * Eigen::Matrix2d::Identity();
  const PlanarVector left = PlanarVector(-400, 300) / 500;
  load.torque_Nm = cross(0.2 * left, load.force_N);
  load.torque_variance_N2m2 = 25;
  EXPECT_NEAR(line_of_action(load).offset_m, 0.2, 1e-12);
  EXPECT_NEAR(line_of_action(load).sigma_m, std::sqrt(25 + 0.04 * 100) / 500, 1e-9);
  load.force_N *= 0.05;
  EXPECT_EQ(line_of_action(load).sigma_m, 0) << "25 N of which one does not know 10";
}

struct Push {
  PlanarVector place_m, force_N;  // bucket axes, frame M
  std::size_t side;
};

/// Pushes on the middle of a side, at 30 degrees or more to it, against its outward normal.
template <typename Random>
Push push_on(const MachineDescription& machine, std::size_t side, const JointVector& joints_rad, Random& random) {
  std::uniform_real_distribution<double> uniform;
  const auto outline = bucket_outline(machine);
  const PlanarVector from = outline[side], to = outline[(side + 1) % outline.size()];
  const PlanarVector place = from + (0.15 + 0.7 * uniform(random)) * (to - from);
  const PlanarVector along = (to - from).normalized();
  const double tilt = (2 * uniform(random) - 1) * 60 * std::numbers::pi / 180;
  const PlanarVector inward = Eigen::Rotation2Dd(tilt) * PlanarVector(-along.y(), along.x());
  const double size_N = 1000 * std::exp(1.6 * uniform(random));
  return {place, Eigen::Rotation2Dd(joints_rad.sum()) * (size_N * inward), side};
}

TEST(BucketTorque, AndLineAndSideAreToldAsSurelyAsTheyAreSeen) {
  Bench bench(machine_with(ContactModel::kBucketForce));
  const TouchedSides sides(bench.machine);
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  int covered = 0, right = 0, all = 0;
  std::vector<double> off_m;
  for (int k = 0; k < 3000; ++k) {
    const JointVector joints(0.9 * uniform(random) - 0.2, -2.0 + 1.2 * uniform(random), -1.8 + 1.8 * uniform(random));
    constexpr std::array<std::size_t, 3> kWide{0, 1, 2};  // teeth, floor, back: what is pushed on
    const Push push = push_on(bench.machine, kWide[static_cast<std::size_t>(k) % kWide.size()], joints, random);
    const JointVector noise(40 * normal(random), 25 * normal(random), 10 * normal(random));
    const JointVector torque = bench.torque(joints, push.force_N, push.place_m) + noise;
    const BucketLoad found = bench.step(bench.pose(joints), torque).load;
    const PlanarVector shift = Eigen::Rotation2Dd(joints.sum()) * (push.place_m - bench.tip());
    const double truth_Nm = cross(shift, push.force_N);
    ++all;
    covered += std::abs(found.torque_Nm - truth_Nm) < 1.96 * std::sqrt(found.torque_variance_N2m2);
    const LineOfAction line = line_of_action(found);
    off_m.push_back(std::abs(line.offset_m + truth_Nm / push.force_N.norm()));
    const auto shares = sides.shares(joints, found);
    EXPECT_LE(std::accumulate(shares.begin(), shares.end(), 0.0), 1 + 1e-9);
    right += shares[push.side] > 0.5;
  }
  std::sort(off_m.begin(), off_m.end());
  EXPECT_GT(covered, 0.9 * all);
  EXPECT_LT(covered, 0.995 * all);
  EXPECT_LT(off_m[off_m.size() / 2], 0.03);
  EXPECT_LT(off_m[off_m.size() * 95 / 100], 0.08);
  EXPECT_GT(right, 0.9 * all) << right << " of " << all;
}

TEST(TouchedSides, AForceThatPassesTheBucketTouchesNone) {
  const MachineDescription machine = machine_with(ContactModel::kBucketForce);
  BucketLoad load;
  load.force_N = {-1000, 0};
  load.covariance_N2 = 400 * Eigen::Matrix2d::Identity();
  load.torque_Nm = 1500;  // its line passes the tip at 1.5 m
  load.torque_variance_N2m2 = 400;
  const auto shares = TouchedSides(machine).shares(kBent, load);
  EXPECT_LT(std::accumulate(shares.begin(), shares.end(), 0.0), 0.01);
  load.force_N.setZero();
  const auto none = TouchedSides(machine).shares(kBent, load);
  EXPECT_EQ(std::accumulate(none.begin(), none.end(), 0.0), 0);
}

}  // namespace
}  // namespace knuckle::estimation
