// The hand of somebody without a haptic device.
#include <gtest/gtest.h>

#include "app/console/hand_input.h"
#include "app/console/operator_station.h"
#include "machine/load.h"
#include "sim/person.h"

namespace knuckle::console {
namespace {

/// A hand that is where it means to be, unless it is held back.
struct HandRig {
  MachineDescription machine = load_machine(find_config("machine", "solar015"));
  DeviceDescription device = load_device(find_config("device", "knuckle1"));
  sim::LimbImpedance limb = sim::sample_limb(sim::LimbClass::kNormal, 1);
  PersonHand person{device, machine, limb};
  HandInput held;
  sim::OperatorView seen;
  sim::OperatorIntent intent;
  Time now{};
  bool held_back = false;
  double scale = 1;

  HandRig() {
    seen.hand_rad = seen.ghost_rad = seen.machine_rad = JointVector(0.3, -1.4, -0.9);
    seen.mode = Mode::kReady;
  }
  void run(Duration time) {
    for (const Time until = now + time; now < until;) {
      now += 1ms;
      intent = person.step(now, held, seen, scale);
      if (held_back || !intent.presence) continue;
      seen.ghost_rad += scale * (intent.joint_rad - seen.hand_rad);
      seen.hand_rad = intent.joint_rad;
    }
  }
};

TEST(PersonHand, IsOffTheDeviceUntilSomebodyTakesHoldThenPressesEnableAndLetsGoAtOnce) {
  HandRig rig;
  rig.held.enable = true;  // without presence it means nothing
  rig.held.rate_radps = kFullRate_radps;
  rig.run(500ms);
  EXPECT_FALSE(rig.intent.presence || rig.intent.enable);
  EXPECT_EQ(rig.intent.joint_rad, rig.seen.hand_rad);
  rig.held.presence = rig.held.enable = true;
  rig.run(200ms);
  EXPECT_TRUE(rig.intent.presence);
  EXPECT_FALSE(rig.intent.enable);
  rig.run(200ms);
  EXPECT_TRUE(rig.intent.enable);
  rig.held.enable = false;
  rig.run(1ms);
  EXPECT_FALSE(rig.intent.enable);
}

TEST(PersonHand, BringsTheGhostToTheMachineWhileEnableIsHeldAtAnyScale) {
  for (const double scale : {0.5, 1.0, 1.6}) {
    HandRig rig;
    rig.scale = scale;
    rig.seen.ghost_rad += JointVector(0.2, -0.15, 0.25);
    rig.seen.mode = Mode::kAligning;
    rig.held.presence = rig.held.enable = true;
    rig.held.rate_radps = kFullRate_radps;  // not before the machine is led
    rig.run(3s);
    EXPECT_LT((rig.seen.ghost_rad - rig.seen.machine_rad).cwiseAbs().maxCoeff(), 0.01) << scale;
  }
}

TEST(PersonHand, MovesTheMachinePoseAskedForAtTheRateAskedForAtAnyScale) {
  for (const double scale : {0.5, 1.0, 1.6}) {
    HandRig rig;
    rig.scale = scale;
    rig.seen.mode = Mode::kEngaged;
    rig.held.presence = rig.held.enable = true;
    rig.held.rate_radps = JointVector(0.1, -0.1, 0.2);
    rig.run(500ms);  // up to speed
    const JointVector before = rig.seen.ghost_rad;
    rig.run(1s);
    EXPECT_TRUE((rig.seen.ghost_rad - before).isApprox(rig.held.rate_radps, 1e-6)) << scale;
  }
}

TEST(PersonHand, StartsAndStopsWithoutAJerk) {
  HandRig rig;
  rig.seen.mode = Mode::kEngaged;
  rig.held.presence = true;
  rig.run(10ms);
  rig.held.rate_radps = kFullRate_radps;
  JointVector last = JointVector::Zero();
  for (int i = 0; i < 700; ++i) {
    if (i == 400) rig.held.rate_radps.setZero();
    rig.run(1ms);
    for (int j = 0; j < kJoints; ++j)
      ASSERT_LE(std::abs(rig.intent.rate_radps[j] - last[j]), 0.0041 * kFullRate_radps[j]) << i;
    last = rig.intent.rate_radps;
  }
  EXPECT_LT(last.norm(), 1e-9);
}

TEST(PersonHand, StaysWithinTheRangesOfDeviceAndMachine) {
  HandRig rig;
  rig.seen.mode = Mode::kEngaged;
  rig.held.presence = rig.held.enable = true;
  for (const double sign : {1.0, -1.0}) {
    rig.held.rate_radps = sign * kFullRate_radps;
    rig.run(12s);
    for (std::size_t i = 0; i < kJoints; ++i) {
      const double at = rig.intent.joint_rad[Eigen::Index(i)];
      EXPECT_GE(at, rig.device.min_rad[i]);
      EXPECT_LE(at, rig.device.max_rad[i]);
      const double end = sign > 0 ? rig.machine.links[i].max_rad : rig.machine.links[i].min_rad;
      EXPECT_NEAR(rig.seen.ghost_rad[Eigen::Index(i)], end, 2e-3);
    }
  }
}

TEST(PersonHand, LeansOnAWallNoHarderThanAHandDoes) {
  HandRig rig;
  rig.seen.mode = Mode::kEngaged;
  rig.held.presence = rig.held.enable = true;
  rig.held_back = true;
  rig.held.rate_radps = kFullRate_radps;
  rig.run(20s);
  const master::DeviceKinematics kinematics(rig.device.link_m);
  const double ahead_m =
      (kinematics.posture(rig.intent.joint_rad).tip_m - kinematics.posture(rig.seen.hand_rad).tip_m).norm();
  EXPECT_GT(rig.limb.stiffness_N_per_m * ahead_m, 2);
  EXPECT_LT(rig.limb.stiffness_N_per_m * ahead_m, 8);  // what the device can hold
}

TEST(PersonHand, InAHoldMovesWithTheClutchAloneAndGoesBackToTheMachineWithoutIt) {
  HandRig rig;
  rig.seen.mode = Mode::kHold;
  rig.held.presence = rig.held.enable = rig.held.clutch = true;
  rig.held.rate_radps = JointVector(0.2, 0, 0);
  const JointVector before = rig.seen.hand_rad;
  rig.run(1s);
  EXPECT_TRUE(rig.intent.clutch);
  EXPECT_GT(rig.seen.hand_rad[kBoom] - before[kBoom], 0.15);
  rig.held.clutch = false;
  rig.seen.ghost_rad[kArm] += 0.3;
  rig.run(4s);
  EXPECT_LT((rig.seen.ghost_rad - rig.seen.machine_rad).cwiseAbs().maxCoeff(), 0.01);
}

}  // namespace
}  // namespace knuckle::console
