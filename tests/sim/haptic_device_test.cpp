// Haptic device, limb and firmware: physics first, then the firmware's promises on the wire.
#include "sim/haptic_device.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/master/desk.h"
#include "transport/hid_pair.h"

namespace knuckle::sim {
namespace {

using test::desk_device;
using test::kMidPosture;
using test::steady_limb;

/// Device on a cable whose host end the test plays.
struct Bench {
  explicit Bench(const LimbImpedance& limb = steady_limb(), DeviceDescription description = desk_device())
      : device(description), hand(device, limb, cable.device(), 3, kMidPosture) {
    intent.joint_rad = kMidPosture;
    intent.presence = true;
  }
  void tick() {
    now += 1ms;
    cable.advance();
    hand.step(now, intent);
    HidReport report;
    while (cable.host().read(report)) {
      if (const auto decoded = decode_state(report)) {
        state = *decoded;
        ++reports;
      }
    }
  }
  void command(TorqueMode mode, const JointVector& torque_Nm) {
    DeviceCommand command;
    command.sequence = ++sequence;
    command.mode = mode;
    for (std::size_t i = 0; i < kJoints; ++i) {
      const double rated =
          device.joint_sign[i] * device.gear_ratio[i] * device.torque_constant_Nm_per_A[i] * device.rated_current_A[i];
      command.torque_permille[i] = std::int16_t(std::lround(1e3 * torque_Nm[Eigen::Index(i)] / rated));
      command.limit_permille[i] = 5000;
    }
    cable.host().write(encode(command));
  }
  void hold_torque(const JointVector& torque_Nm, double seconds) {
    for (int i = 0; i < int(seconds * 1e3); ++i) {
      command(TorqueMode::kTorque, torque_Nm);
      tick();
    }
  }
  double felt() const { return hand.truth().felt_N.norm(); }

  DeviceDescription device;
  HidPair cable;
  HandAndDevice hand;
  OperatorIntent intent;
  DeviceState state;
  int reports = 0;
  std::uint16_t sequence = 0;
  Time now{};
};

DeviceDescription frictionless() {
  DeviceDescription device = desk_device();
  device.friction_Nm = device.viscous_Nms = device.cogging_Nm = {};
  return device;
}
const JointVector kPush{0.4, 0.1, 0.02};

TEST(HapticDevice, HandGivesWayByForceOverStiffness) {
  Bench bench(steady_limb(), frictionless());
  const PlanarVector before_m = bench.hand.truth().tip_m;
  bench.hold_torque(kPush, 3);
  const HandTruth& truth = bench.hand.truth();
  // In rest the limb's spring carries the whole tip force, and the rest of the torque turns the wrist.
  EXPECT_NEAR((truth.contact_N - 400 * (truth.tip_m - before_m)).norm(), 0, 1e-6);
  const double wrist_Nm = 4 * (truth.joint_rad - kMidPosture).sum();
  const PlanarVector finger_m = truth.tip_m - PlanarVector::Zero();
  // Moment balance about the forearm's axis.
  const double moment_Nm = finger_m.x() * truth.contact_N.y() - finger_m.y() * truth.contact_N.x();
  EXPECT_NEAR(moment_Nm + wrist_Nm, truth.motor_torque_Nm[0], 2e-3);
  EXPECT_NEAR(truth.motor_torque_Nm[0], kPush[0], 2e-3);
}

TEST(HapticDevice, MotorWorkIsKineticPlusSpringPlusLossEnergy) {
  LimbImpedance lossless = steady_limb();
  lossless.damping_Ns_per_m = lossless.wrist_damping_Nms = 0;
  Bench bench(lossless, frictionless());
  bench.hold_torque(kPush, 0.05);  // short: the implicit step's own losses are second order in time
  const HandTruth& truth = bench.hand.truth();
  Bench still(lossless, frictionless());
  const PlanarVector from_m = still.hand.truth().tip_m;
  const auto square = [](double x) { return x * x; };
  double energy_J = 0.5 * 400 * (truth.tip_m - from_m).squaredNorm() + 0.5 * 1.0 * truth.tip_mps.squaredNorm() +
                    0.5 * 4 * square((truth.joint_rad - kMidPosture).sum()) +
                    0.5 * 3e-3 * square(truth.rate_radps.sum());
  for (std::size_t i = 0; i < kJoints; ++i) {
    const double inertia =
        bench.device.link_inertia_kgm2[i] + square(bench.device.gear_ratio[i]) * bench.device.rotor_inertia_kgm2[i];
    energy_J += 0.5 * inertia * square(truth.rate_radps[Eigen::Index(i)]);
  }
  EXPECT_GT(energy_J, 1e-3);
  EXPECT_NEAR(truth.energy_to_hand_J / energy_J, 1, 0.03);
}

TEST(HapticDevice, FrictionHoldsASmallTorqueStill) {
  DeviceDescription device = desk_device();
  device.cogging_Nm = {};
  Bench bench(steady_limb(), device);
  bench.intent.presence = false;  // nobody holds it: only friction does
  bench.hold_torque(JointVector(0.004, 0, 0), 2);
  EXPECT_LT(std::abs(bench.hand.truth().rate_radps[0]), 1e-6);
  EXPECT_LT(std::abs(bench.hand.truth().joint_rad[0] - kMidPosture[0]), 1e-3);
  bench.hold_torque(JointVector(0.02, 0, 0), 0.2);
  EXPECT_GT(bench.hand.truth().rate_radps[0], 0.1);
}

TEST(HapticDevice, ReportsAnglesInCountsWithSignAndZero) {
  Bench bench;
  for (int i = 0; i < 5; ++i) bench.tick();
  EXPECT_NEAR(bench.state.counts[0], 12000 + 0.35 * 15 * 32768 / (2 * 3.14159265), 3);
  EXPECT_NEAR(bench.state.counts[1], -4000 + 1.5 * 15 * 16384 / (2 * 3.14159265), 3);
  EXPECT_EQ(bench.reports, 4);  // one a millisecond, one millisecond on the cable
}

TEST(HapticDevice, DrawsTheSameLimbForTheSameSeedAndStaysInItsClass) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const LimbImpedance limb = sample_limb(LimbClass::kLightGrip, seed);
    EXPECT_EQ(limb.mass_kg, sample_limb(LimbClass::kLightGrip, seed).mass_kg);
    EXPECT_TRUE(limb.mass_kg >= 0.05 && limb.mass_kg <= 0.5) << seed;
    EXPECT_TRUE(limb.damping_Ns_per_m >= 0.3 && limb.damping_Ns_per_m <= 5) << seed;
    EXPECT_TRUE(limb.stiffness_N_per_m >= 5 && limb.stiffness_N_per_m <= 60) << seed;
    EXPECT_TRUE(limb.wrist_inertia_kgm2 >= 2e-3 && limb.wrist_inertia_kgm2 <= 5e-3) << seed;
  }
  EXPECT_NE(sample_limb(LimbClass::kNormal, 1).mass_kg, sample_limb(LimbClass::kNormal, 2).mass_kg);
}

TEST(DeviceFirmware, TakesTorqueAwayTwentyMillisecondsAfterTheLastCommandWithoutAKick) {
  Bench bench;
  const JointVector strong{1.5, 0.5, 0.1};
  bench.hold_torque(strong, 0.2);
  double worst_slew = 0, last = bench.felt();
  int gone_after = 0;
  for (int i = 1; i <= 100; ++i) {
    bench.tick();
    worst_slew = std::max(worst_slew, std::abs(bench.felt() - last));
    last = bench.felt();
    if (gone_after == 0 && !(bench.state.status & kDeviceTorqueOn)) gone_after = i;
  }
  EXPECT_GE(gone_after, 20);
  EXPECT_LE(gone_after, 24);
  EXPECT_LT(worst_slew, 0.4);
  for (int i = 0; i < 1000; ++i) bench.tick();
  EXPECT_LT(bench.felt(), 0.01);
  EXPECT_TRUE(bench.state.fault & kDeviceFaultWatchdog);
}

TEST(DeviceFirmware, StaysLatchedUntilModeOffIsCommanded) {
  Bench bench;
  bench.hold_torque(kPush, 0.1);
  for (int i = 0; i < 50; ++i) bench.tick();
  bench.hold_torque(kPush, 0.1);  // torque commands alone do not bring it back
  EXPECT_TRUE(bench.state.status & kDeviceLatched);
  EXPECT_FALSE(bench.state.status & kDeviceTorqueOn);
  bench.command(TorqueMode::kOff, JointVector::Zero());
  for (int i = 0; i < 3; ++i) bench.tick();
  EXPECT_FALSE(bench.state.status & kDeviceLatched);
  EXPECT_EQ(bench.state.fault, 0);
  bench.hold_torque(kPush, 0.1);
  EXPECT_TRUE(bench.state.status & kDeviceTorqueOn);
}

TEST(DeviceFirmware, LatchesOnARepeatedSequenceAndOnADamagedCommand) {
  for (const bool repeat : {true, false}) {
    Bench bench;
    bench.hold_torque(kPush, 0.05);
    DeviceCommand command;
    command.mode = TorqueMode::kTorque;
    command.sequence = repeat ? bench.sequence : std::uint16_t(bench.sequence + 1);
    HidReport report = encode(command);
    if (!repeat) report[12] ^= 1;
    bench.cable.host().write(report);
    for (int i = 0; i < 4; ++i) bench.tick();
    EXPECT_TRUE(bench.state.status & kDeviceLatched);
    EXPECT_EQ(bench.state.fault, repeat ? kDeviceFaultSequence : kDeviceFaultCrc);
  }
}

TEST(DeviceFirmware, LimitsCurrentToTheMotorsPeak) {
  Bench bench;
  bench.hold_torque(JointVector(5, 0, 0), 0.05);
  EXPECT_NEAR(bench.hand.truth().motor_torque_Nm[0], 15 * 0.0259 * 7, 1e-3);
}

TEST(DeviceFirmware, TripsWhenAMotorOverheats) {
  Bench bench;
  bench.hold_torque(JointVector(2.6, 0, 0), 20);
  EXPECT_TRUE(bench.state.fault & kDeviceFaultOvertemperature);
  EXPECT_LT(bench.felt(), 0.05);
}

TEST(DeviceFirmware, DampsTheDeviceWhenNobodyCommands) {
  Bench thrown, off;
  for (Bench* bench : {&thrown, &off}) {
    bench->hold_torque(JointVector(0.3, 0, 0), 0.01);
    bench->intent.presence = false;
    if (bench == &off) bench->command(TorqueMode::kOff, JointVector::Zero());
    for (int i = 0; i < 150; ++i) bench->tick();
  }
  EXPECT_LT(std::abs(thrown.hand.truth().rate_radps[0]), 0.6 * std::abs(off.hand.truth().rate_radps[0]));
}

}  // namespace
}  // namespace knuckle::sim
