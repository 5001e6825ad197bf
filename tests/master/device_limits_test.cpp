// What keeps the device's motors and energy within bounds, and its kinematics.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "master/master_loop.h"
#include "tests/master/master_rig.h"

namespace knuckle::master {
namespace {

using test::kMidPosture;
using test::MasterRig;

TEST(TorqueLimiter, HoldsMotorsAtRatedCurrentBeforeTheFirmwareTrips) {
  MasterRig rig(ControlLaw::kDirect);
  rig.engage();
  rig.follow = false;
  rig.intent.joint_rad = kMidPosture;
  rig.react = [](MasterRig& r) { r.machine.tip_force_N = PlanarVector(0, 8000); };
  double hottest = 0;
  for (int i = 0; i < 60000; ++i) {
    rig.tick();
    for (const double heat : rig.hand.truth().motor_heat) hottest = std::max(hottest, heat);
  }
  EXPECT_GT(hottest, 0.85);
  EXPECT_LT(hottest, 1.02);
  EXPECT_FALSE(rig.hand.firmware().latched());
  EXPECT_GT(rig.hand.truth().felt_N.norm(), 2);
}

TEST(TorqueLimiter, RendersNoMoreThanTheForceLimitWhateverIsAddedUp) {
  const DeviceDescription device = test::desk_device();
  TorqueLimiter limiter(device);
  const auto posture = DeviceKinematics(device.link_m).posture(kMidPosture);
  const JointVector contact_Nm = posture.jacobian.transpose() * PlanarVector(0, device.feel.force_limit_N);
  const JointVector wall_Nm(0.6 * device.feel.force_limit_N * 0.32, 0, 0);
  JointVector torque_Nm;
  for (int i = 0; i < 200; ++i) torque_Nm = limiter.step(contact_Nm + wall_Nm, posture.jacobian, 1e-3);
  EXPECT_LT(tip_force_of(posture.jacobian, torque_Nm).norm(), 1.001 * device.feel.force_limit_N);
  EXPECT_LT(limiter.share(), 0.9);
  EXPECT_NEAR(torque_Nm.normalized().dot((contact_Nm + wall_Nm).normalized()), 1, 1e-9) << "its direction stays";
  for (int i = 0; i < 200; ++i) torque_Nm = limiter.step(0.9 * contact_Nm, posture.jacobian, 1e-3);
  EXPECT_NEAR((torque_Nm - 0.9 * contact_Nm).norm(), 0, 1e-12);
  EXPECT_EQ(limiter.share(), 1);
}

TEST(TorqueLimiter, TakesANonFiniteTorqueForNone) {
  TorqueLimiter limiter(test::desk_device());
  const auto posture = DeviceKinematics(test::desk_device().link_m).posture(kMidPosture);
  const JointVector wanted(std::numeric_limits<double>::quiet_NaN(), 1, 1);
  EXPECT_EQ(limiter.step(wanted, posture.jacobian, 1e-3).norm(), 0);
}

TEST(TorqueLimiter, MotorsCoolWhileTheDeviceIsOff) {
  DeviceDescription strong_hand = test::desk_device();
  strong_hand.feel.force_limit_N = 1e6;  // the motors limit the force
  TorqueLimiter limiter(strong_hand);
  const auto posture = DeviceKinematics(test::desk_device().link_m).posture(kMidPosture);
  const JointVector wanted_Nm = JointVector::Constant(1e3);
  const auto press = [&](double seconds) {
    JointVector torque_Nm;
    for (double t = 0; t < seconds; t += 1e-3) torque_Nm = limiter.step(wanted_Nm, posture.jacobian, 1e-3);
    return torque_Nm.norm();
  };
  const double cold_Nm = press(1);
  const double hot_Nm = press(120);
  ASSERT_LT(hot_Nm, 0.9 * cold_Nm);
  limiter.rest(1e-3);
  EXPECT_EQ(limiter.heat_share(), 1) << "nothing is wanted, nothing is taken away";
  for (double t = 0; t < 600; t += 1e-3) limiter.rest(1e-3);
  EXPECT_NEAR(press(1), cold_Nm, 0.01 * cold_Nm);
}

TEST(EnergyPort, LowersTheForceWhileMoreThanHalfAJouleNetComesBackInTwoSeconds) {
  EnergyPort port;
  for (int i = 0; i < 1000; ++i) port.step(-2, 1e-3);  // the hand puts in 2 J,
  for (int i = 0; i < 900; ++i) port.step(2, 1e-3);    // and 1.8 J come back within the window
  EXPECT_EQ(port.gain(), 1);
  EXPECT_NEAR(port.in_J(), 2, 1e-9);
  EXPECT_NEAR(port.out_J(), 1.8, 1e-9);
  double last = 1;
  for (int i = 0; i < 3000; ++i) {
    port.step(1, 1e-3);
    EXPECT_LT(last - port.gain(), 0.003);
    last = port.gain();
  }
  EXPECT_EQ(port.gain(), 0);
  for (int i = 0; i < 8000; ++i) port.step(0, 1e-3);
  EXPECT_EQ(port.gain(), 1);
}

TEST(DeviceKinematics, JacobianIsTheDerivativeOfTheTip) {
  const DeviceKinematics kinematics(test::desk_device().link_m);
  const DevicePosture posture = kinematics.posture(kMidPosture);
  for (Eigen::Index i = 0; i < kJoints; ++i) {
    JointVector moved = kMidPosture;
    moved[i] += 1e-6;
    const PlanarVector slope = (kinematics.posture(moved).tip_m - posture.tip_m) / 1e-6;
    EXPECT_NEAR((slope - posture.jacobian.col(i)).norm(), 0, 1e-6);
  }
  EXPECT_NEAR((kinematics.posture(JointVector::Zero()).tip_m - PlanarVector(0.32, 0)).norm(), 0, 1e-12);
  const PlanarVector force(3, -2);
  EXPECT_NEAR((tip_force_of(posture.jacobian, posture.jacobian.transpose() * force) - force).norm(), 0, 5e-3);
}

}  // namespace
}  // namespace knuckle::master
