// Weighing a known load on a synthetic machine, with and without today's oil.
#include "estimation/payload.h"

#include <gtest/gtest.h>

#include <utility>

#include "estimation/regressor.h"
#include "tests/estimation/test_machine.h"

namespace knuckle::estimation {
namespace {

/// A machine with a load at a point of its bucket, weighed while it moves.
class Scale {
 public:
  explicit Scale(const SyntheticErrors& errors)
      : machine_(test_machine(), errors),
        filter_(test_machine(), kStep_s, 5),
        estimator_(test_machine(), kStep_s),
        payload_(test_machine(), kStep_s) {
    motion_.omega_radps *= 0.6;
  }
  void move(double seconds, double mass_kg, const PlanarVector& tip_N = PlanarVector::Zero()) {
    const PlanarVector at(0.3, 0.15);
    for (double t = 0; t < seconds; t += kStep_s) {
      clock_s_ += kStep_s;
      const SineMotion::Point p = motion_.at(clock_s_);
      const Pose pose(p.angle, 0);
      const double bucket = at.x() * pose.cos[2] - at.y() * pose.sin[2];
      const double arm = bucket + 0.95 * pose.cos[1], boom = arm + 1.75 * pose.cos[0];
      const JointVector torque = -kGravity_mps2 * mass_kg * JointVector(boom, arm, bucket) +
                                 machine_.kinematics().tip_jacobian(p.angle).transpose() * tip_N;
      const JointState state = *filter_.step(machine_.measure(p, torque));
      payload_.step(state, estimator_.step(state));
      estimator_.hold_bias(payload_.maybe_loaded());
      estimator_.carry(payload_.carried());
    }
  }
  /// From now on, before anything has moved: millimetres, quickly.
  void move_hardly() {
    motion_.amplitude_rad *= 0.01;
    motion_.omega_radps *= 20;
  }
  PayloadEstimator& payload() { return payload_; }
  const ForceEstimate& force() const { return estimator_.estimate(); }

 private:
  SyntheticMachine machine_;
  JointStateFilter filter_;
  ForceEstimator estimator_;
  PayloadEstimator payload_;
  SineMotion motion_;
  double clock_s_ = 0;
};

SyntheticErrors machine_of_today() {
  SyntheticErrors e = real_sensors();
  e.bias_N = JointVector(400, -300, 350);
  e.friction_factor = 1.25;
  e.mass_factor = 1.04;
  return e;
}

/// After 40 s of free motion.
Scale warmed_up() {
  Scale scale(machine_of_today());
  scale.move(40, 0);
  return scale;
}

TEST(Payload, LiftStartsByItselfWhenAWeightIsHungOn) {
  EXPECT_GT(Scale(real_sensors()).payload().sigma_kg(), 100) << "before anything moved";
  Scale scale = warmed_up();
  scale.move(5, 50);
  EXPECT_NEAR(scale.payload().kg(), 50, 5);
  EXPECT_LT(scale.payload().sigma_kg(), 5);
}

TEST(Payload, SmallLoadIsNotLearnedAway) {
  Scale scale = warmed_up();
  scale.move(1, 0, {600, 900});
  scale.move(60, 10);
  EXPECT_NEAR(scale.payload().kg(), 10, 4);
}

TEST(Payload, KnownLoadIsNoForceOfContactAndItsLossIsSeen) {
  Scale scale = warmed_up();
  scale.move(0.5, 50);
  EXPECT_TRUE(scale.force().contact);
  EXPECT_GT(scale.force().tip_N.norm(), 150);
  scale.move(7, 50);
  EXPECT_FALSE(scale.force().contact);
  EXPECT_LT(scale.force().tip_N.norm(), 100);
  scale.move(1.5, 0);
  EXPECT_LT(scale.force().tip_N.norm(), 100);
  scale.move(6, 0);
  EXPECT_FALSE(scale.payload().maybe_loaded());
  EXPECT_NEAR(scale.payload().kg(), 0, 3);
}

TEST(Payload, PullDownThatIsTakenForALoadStaysInTheWholeForce) {
  Scale scale = warmed_up();
  const PlanarVector pull_N(0, -1300);
  scale.move(6, 0, pull_N);
  EXPECT_GT(scale.payload().kg(), 100);
  EXPECT_GT((scale.force().tip_N - pull_N).norm(), 500);
  EXPECT_LT((scale.force().loaded_tip_N - pull_N).norm(), 60);
}

TEST(Payload, ContactIsStillFeltInFullWithALoadInTheBucket) {
  Scale scale = warmed_up();
  scale.move(8, 50);
  scale.move(0.5, 50, {-1500, 0});
  EXPECT_NEAR(scale.force().tip_N.x(), -1500, 200);
  EXPECT_TRUE(scale.force().contact);
}

TEST(Payload, DiggingLeavesNoLoadInAnEmptyBucket) {
  Scale scale = warmed_up();
  for (int i = 0; i < 6; ++i) scale.move(0.5, 0, {800 + 100.0 * (i % 3), 1200 - 250.0 * (i % 4)});
  scale.move(15, 0);
  EXPECT_NEAR(scale.payload().kg(), 0, 3);
  EXPECT_NEAR(scale.payload().carried()[0], 0, 1e-6);
  EXPECT_FALSE(scale.payload().maybe_loaded());
}

// A wall overhead pushes like a load, but does not let the bucket rise or sink.
TEST(Payload, PushDownOnABucketThatIsNotLiftedIsNoLoad) {
  Scale scale(machine_of_today());
  scale.move_hardly();
  scale.move(40, 0);
  EXPECT_FALSE(scale.force().confidence_reasons & kBiasNotLearned);
  scale.move(5, 0, {0, -1500});
  EXPECT_GT(scale.payload().kg(), 100);
  EXPECT_LT(scale.payload().kg(), 3 * scale.payload().sigma_kg());
  EXPECT_EQ(scale.payload().carried(), Load::Zero());
  EXPECT_LT((scale.force().tip_N - PlanarVector(0, -1500)).norm(), 200);
}

/// A load on a boom that turns, with torques as they are: what the estimator makes of heights and gaps alone.
class Hoist {
 public:
  Hoist() : payload_(test_machine(), kStep_s) {
    force_.lever_m = force_.turned_lever_m = JointVector::Constant(0.4);
    state_.angle_rad = JointVector(0.3, -1.0, -0.6);
  }
  /// `pushed_kg`: of a load's weight, or of a wall that pushes down as much.
  void turn(double seconds, double radps, double pushed_kg) {
    const MachineDescription m = test_machine();
    const JointVector length_m(m.links[0].length_m, m.links[1].length_m, m.links[2].length_m);
    for (double t = 0; t < seconds; t += kStep_s) {
      state_.angle_rad[0] += radps * kStep_s;
      force_.rod_mps = force_.lever_m * radps;
      force_.turned_lever_m = force_.lever_m * (radps < 0 ? -1 : 1);
      const Eigen::Matrix3d columns = load_columns(length_m, Pose(state_.angle_rad, 0));
      const JointVector of_one_kg = columns.col(0) + columns.rightCols<2>() * m.payload_com_m;
      force_.joint_torque_Nm = pushed_kg * of_one_kg - force_.carried_Nm;
      payload_.step(state_, force_);
      force_.carried_Nm = payload_.carried()[0] * of_one_kg;
    }
  }
  /// Millimetres up and down.
  void nudge(double seconds, double from_kg, double to_kg) {
    for (double t = 0; t < seconds; t += 0.2) {
      const double now_kg = from_kg + (to_kg - from_kg) * t / seconds;
      turn(0.1, 0.03, now_kg);
      turn(0.1, -0.03, now_kg);
    }
  }
  void turn_unseen(double rad) {
    state_.angle_rad[0] += rad;
    payload_.restart_motion();
  }
  /// The bucket's cylinder has no lever there.
  void turn_at_dead_point(double seconds, double radps, double pushed_kg) {
    const double lever_m = std::exchange(force_.lever_m[kBucket], 0.0);
    turn(seconds, radps, pushed_kg);
    force_.lever_m[kBucket] = lever_m;
  }
  void touch(bool contact) { force_.contact = contact; }
  PayloadEstimator& payload() { return payload_; }
  bool known() const { return payload_.kg() > 3 * payload_.sigma_kg(); }

 private:
  PayloadEstimator payload_;
  JointState state_;
  ForceEstimate force_;
};

TEST(Payload, OfALiftThatBeganAnewTheWayBeforeDoesNotCount) {
  Hoist hoist;
  hoist.turn(3, 0.03, 50);
  EXPECT_TRUE(hoist.known());
  hoist.payload().start();
  hoist.nudge(4, 50, 50);
  EXPECT_FALSE(hoist.known());
}

TEST(Payload, WayThatNobodySawIsNoLift) {
  Hoist hoist;
  hoist.nudge(2, 150, 150);
  hoist.turn_unseen(0.1);
  hoist.nudge(2, 150, 150);
  EXPECT_FALSE(hoist.known());
}

/// Updates disagree with the load so far, and begin a lift anew.
TEST(Payload, LiftOfAMinuteAgoDoesNotMakeALoadOfAWallThatIsPressedSlowly) {
  Hoist hoist;
  hoist.turn(3, 0.03, 0);
  hoist.nudge(60, 0, 0);
  hoist.nudge(300, 0, 150);
  EXPECT_GT(hoist.payload().kg(), 50);
  EXPECT_FALSE(hoist.known());
}

TEST(Payload, ZeroOnGroundThatCarriesTheBucketIsDoubtedAfterwards) {
  Hoist hoist;
  hoist.nudge(4, -50, -50);
  EXPECT_TRUE(hoist.payload().zero());
  hoist.turn(4, 0.03, 0);
  EXPECT_FALSE(hoist.known());
}

TEST(Payload, ZeroThatIsSetTwiceIsThatOfTheFirstTime) {
  Hoist hoist;
  EXPECT_FALSE(hoist.payload().zero()) << "nothing was weighed yet";
  hoist.turn(4, 0.03, 20);
  EXPECT_TRUE(hoist.payload().zero());
  EXPECT_FALSE(hoist.payload().zero());
  hoist.turn(4, 0.03, 70);
  EXPECT_NEAR(hoist.payload().kg(), 50, 3);
  EXPECT_TRUE(hoist.known());
}

TEST(Payload, ZeroBelowAWallIsDoubtedHoweverOftenItIsSet) {
  Hoist hoist;
  for (int i = 0; i < 6; ++i) {
    hoist.nudge(4, 100, 100);
    EXPECT_TRUE(hoist.payload().zero());
  }
  hoist.turn(4, 0.03, 200);
  EXPECT_FALSE(hoist.known());
}

TEST(Payload, ZeroOfABucketThatWasLiftedEndsTheDoubtOfTheOneBefore) {
  Hoist hoist;
  hoist.nudge(4, 100, 100);
  EXPECT_TRUE(hoist.payload().zero());
  hoist.turn(4, 0.03, 0);
  EXPECT_TRUE(hoist.payload().zero());
  hoist.turn(4, -0.03, 50);
  EXPECT_NEAR(hoist.payload().kg(), 50, 3);
  EXPECT_TRUE(hoist.known());
}

/// Or the bias filter would be held until zero is set anew.
TEST(Payload, BucketThatWeighsLessThanItsZeroIsEmpty) {
  Hoist hoist;
  hoist.turn(4, 0.03, 50);
  EXPECT_TRUE(hoist.payload().zero());
  hoist.touch(true);
  hoist.turn(4, -0.03, 0);
  EXPECT_TRUE(hoist.payload().maybe_loaded());
  hoist.touch(false);
  hoist.turn(1, 0.03, 0);
  EXPECT_LT(hoist.payload().kg(), -40);
  EXPECT_FALSE(hoist.payload().maybe_loaded());
}

/// It may be the ground that carries it.
TEST(Payload, BucketThatWeighsLessThanItsZeroButWasNotLiftedIsNotTakenForEmpty) {
  Hoist hoist;
  hoist.touch(true);
  hoist.nudge(4, -12, -12);
  hoist.touch(false);
  hoist.nudge(4, -12, -12);
  EXPECT_TRUE(hoist.payload().maybe_loaded());
}

TEST(Payload, LoadIsCarriedThroughADeadPointAndBehindIt) {
  for (int step = 0; step < 15; ++step) {  // at each time since the last update
    Hoist hoist;
    hoist.turn(4, 0.05, 50);
    ASSERT_GT(hoist.payload().carried()[0], 45);
    hoist.turn_at_dead_point(1 + step * kStep_s, 0.05, 50);
    EXPECT_GT(hoist.payload().carried()[0], 45) << step;
    hoist.nudge(0.6, 50, 50);
    EXPECT_GT(hoist.payload().carried()[0], 45) << step;
  }
}

/// A machine that moves evenly does not accelerate where it can be followed again.
TEST(Payload, MotionThatIsSeenAgainIsNoAcceleration) {
  for (const bool dead_point : {false, true}) {
    Hoist hoist;
    hoist.turn(4, 0.1, 100);
    const double before_kg = hoist.payload().kg();
    if (dead_point)
      hoist.turn_at_dead_point(0.5, 0.1, 100);
    else
      hoist.turn_unseen(0.01);
    hoist.turn(0.3, 0.1, 100);
    EXPECT_NEAR(hoist.payload().kg(), before_kg, 1) << dead_point;
  }
}

TEST(Payload, HoldsTheBiasBeforeTheLoadIsLifted) {
  Hoist hoist;
  hoist.nudge(4, 50, 50);
  EXPECT_FALSE(hoist.known());
  EXPECT_TRUE(hoist.payload().maybe_loaded());
}

TEST(Payload, ContactIsNotTakenForALoadWithAGoodConscience) {
  Scale scale = warmed_up();
  EXPECT_TRUE(scale.payload().zero());
  scale.move(15, 0, {-1500, 0});
  EXPECT_GT(scale.payload().sigma_kg(), 0.3 * std::abs(scale.payload().kg()));
}

}  // namespace
}  // namespace knuckle::estimation
