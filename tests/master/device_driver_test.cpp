// The driver against the simulated device: handshake, age, damaged reports, unplugging.
#include "master/device_driver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sim/haptic_device.h"
#include "tests/master/desk.h"
#include "transport/hid_pair.h"

namespace knuckle::master {
namespace {

using sim::FirmwareFault;
using test::desk_device;
using test::kMidPosture;
using test::steady_limb;

struct Desk {
  explicit Desk(const DeviceDescription& file = desk_device(), std::uint32_t serial = 77)
      : hand(desk_device(), steady_limb(), cable.device(), 1, kMidPosture, serial), driver(file, cable.host()) {
    intent.joint_rad = kMidPosture;
    intent.presence = intent.enable = true;
  }
  void tick() {
    now += 1ms;
    cable.advance();
    hand.step(now, intent);
    driver.step(host_now());
    driver.command(torque_Nm);
  }
  /// By the computer's clock, which runs faster than the device's by host_drift.
  Time host_now() const {
    return now + host_offset + Duration(std::llround(host_drift * static_cast<double>(now.time_since_epoch().count())));
  }
  void run(int milliseconds) {
    for (int i = 0; i < milliseconds; ++i) tick();
  }
  /// Milliseconds until not ok; 1000 if never.
  int until_refused() {
    for (int i = 1; i < 1000; ++i) {
      tick();
      if (!driver.reading().ok) return i;
    }
    return 1000;
  }
  ReasonCode reason() const { return driver.reading().reason.code; }

  HidPair cable;
  sim::HandAndDevice hand;
  DeviceDriver driver;
  sim::OperatorIntent intent;
  JointVector torque_Nm = JointVector::Zero();
  Time now{};
  double host_drift = 0;
  Duration host_offset{};
};

/// A device that has more to say than anybody can read.
struct Flood final : HidPort {
  bool write(const HidReport&) noexcept override { return true; }
  bool read(HidReport& report) noexcept override {
    report = {};
    return ++reads < 1000000;
  }
  [[nodiscard]] bool connected() const noexcept override { return true; }
  int reads = 0;
};

TEST(DeviceDriver, EndsItsStepHoweverMuchTheDeviceSays) {
  Flood flood;
  DeviceDriver driver(desk_device(), flood);
  driver.step(Time(1ms));
  EXPECT_LE(flood.reads, 128);
  EXPECT_FALSE(driver.reading().ok);
}

TEST(DeviceDriver, ReadsAnglesSpeedsAndButtonsAfterTheHandshake) {
  Desk desk;
  desk.intent.rate_radps = JointVector(0.2, 0, 0);
  for (int i = 0; i < 500; ++i) {
    desk.intent.enable = i > 300;
    desk.intent.joint_rad[0] += 0.2e-3;
    desk.tick();
  }
  const DeviceReading& reading = desk.driver.reading();
  ASSERT_TRUE(reading.ok);
  EXPECT_TRUE(reading.presence && reading.enable && !reading.clutch && !reading.stop);
  EXPECT_NEAR((reading.joint_rad - desk.hand.truth().joint_rad).norm(), 0, 5e-4);  // one millisecond late
  EXPECT_NEAR((reading.rate_radps - desk.hand.truth().rate_radps).norm(), 0, 0.01);
  EXPECT_LE(desk.now - reading.measured_at, 2ms);
}

TEST(DeviceDriver, AClockThatATimeServiceSlewsDoesNotMakeItStale) {
  for (const double drift : {-600e-6, 600e-6}) {
    Desk desk;
    desk.host_drift = drift;
    for (int s = 1; s <= 60; ++s) {
      desk.run(1000);
      ASSERT_TRUE(desk.driver.reading().ok) << drift << ", " << s << " s";
      ASSERT_LE(desk.host_now() - desk.driver.reading().measured_at, 3ms) << drift << ", " << s << " s";
    }
  }
}

TEST(DeviceDriver, ADelayThatStaysIsNotForgotten) {
  Desk desk;
  desk.run(1000);
  desk.host_offset = 15ms;  // by the device's clock all reports come so much later
  desk.run(2000);
  EXPECT_GE(desk.host_now() - desk.driver.reading().measured_at, 12ms);
}

TEST(DeviceDriver, ADelayThatGrowsIsFoundBeforeItIsLong) {
  Desk desk;
  desk.run(1000);
  for (int ms = 0; ms < 6000 && desk.driver.reading().ok; ++ms) {
    desk.host_offset += 5us;
    desk.tick();
  }
  EXPECT_EQ(desk.reason(), ReasonCode::kDeviceStale);
  EXPECT_LT(desk.host_offset, 30ms);
}

TEST(DeviceDriver, AnEnableHeldWhileTheDeviceWasGoneIsNotAPress) {
  Desk desk;
  desk.intent.enable = false;
  desk.run(200);
  desk.intent.enable = true;
  desk.run(10);
  ASSERT_TRUE(desk.driver.reading().enable);
  desk.cable.unplug();
  desk.run(50);
  desk.cable.plug();
  desk.run(500);
  ASSERT_TRUE(desk.driver.reading().ok);
  EXPECT_FALSE(desk.driver.reading().enable);
  desk.intent.enable = false;
  desk.run(10);
  desk.intent.enable = true;
  desk.run(10);
  EXPECT_TRUE(desk.driver.reading().enable);
}

TEST(DeviceDriver, IsNotOkBeforeItHasSeenATenthOfASecondOfGoodReports) {
  Desk desk;
  desk.run(90);
  EXPECT_FALSE(desk.driver.reading().ok);
  EXPECT_FALSE(desk.driver.reading().enable);  // buttons of a device that is not ok do not count
  desk.run(30);
  EXPECT_TRUE(desk.driver.reading().ok);
}

TEST(DeviceDriver, RefusesADeviceThatIsNotTheOneOfItsFile) {
  DeviceDescription other = desk_device();
  other.gear_ratio[1] *= 1.01;
  Desk desk(other);
  desk.run(400);
  EXPECT_EQ(desk.reason(), ReasonCode::kDeviceIdentity);
}

TEST(DeviceDriver, RefusesADeviceOfAnotherSignUnlessTheSignWasMeasuredOnThisVeryDevice) {
  // Firmware and file differ about the wrist: the crossed cable was taken out, and nobody told the firmware.
  DeviceDescription file = desk_device();
  file.joint_sign[1] = -file.joint_sign[1];
  Desk unsure(file);
  unsure.run(400);
  EXPECT_EQ(unsure.reason(), ReasonCode::kDeviceIdentity);
  // Counts that rise the other way are the same counts seen from a mirrored zero.
  const double per_rad = -file.joint_sign[1] * file.gear_ratio[1] * file.counts_per_turn[1] / (2 * std::numbers::pi);
  file.zero_counts[1] += std::int32_t(std::lround(2 * per_rad * kMidPosture[1]));
  file.serial = 77;
  Desk calibrated(file);
  calibrated.run(400);
  ASSERT_TRUE(calibrated.driver.reading().ok);
  EXPECT_NEAR((calibrated.driver.reading().joint_rad - kMidPosture).norm(), 0, 1e-2);
}

TEST(DeviceDriver, TakesTheZeroThatWasMeasuredOnThisVeryDeviceRatherThanTheDevicesOwn) {
  DeviceDescription file = desk_device();
  file.zero_counts[0] += 7823;  // 0.1 rad at the forearm
  Desk any(file);
  any.run(400);
  EXPECT_NEAR(any.driver.reading().joint_rad[0], kMidPosture[0], 1e-2);
  file.serial = 77;
  Desk calibrated(file);
  calibrated.run(400);
  EXPECT_NEAR(calibrated.driver.reading().joint_rad[0], kMidPosture[0] - 0.1, 1e-2);
}

TEST(DeviceDriver, RefusesAnyOtherDeviceThanTheOneItsFileWasCalibratedFor) {
  DeviceDescription file = desk_device();
  file.serial = 78;
  Desk desk(file);
  desk.run(400);
  EXPECT_EQ(desk.reason(), ReasonCode::kDeviceIdentity);
}

struct Story {
  FirmwareFault fault;
  ReasonCode expected;
  int within_ms;
};
class DeviceDriverStories : public testing::TestWithParam<Story> {};

TEST_P(DeviceDriverStories, EndInAReasonInTorqueOffAndRecoverWithoutTorque) {
  const Story story = GetParam();
  Desk desk;
  desk.torque_Nm = JointVector(0.5, 0, 0);
  desk.run(400);
  ASSERT_TRUE(desk.driver.reading().ok);
  desk.hand.firmware().inject(story.fault);
  const int refused_ms = desk.until_refused();
  EXPECT_LE(refused_ms, story.within_ms);
  EXPECT_EQ(desk.reason(), story.expected);
  desk.torque_Nm.setZero();
  desk.run(600);
  EXPECT_LT(desk.hand.truth().felt_N.norm(), 0.05);
  desk.hand.firmware().inject(FirmwareFault::kNone);
  desk.run(300);
  EXPECT_TRUE(desk.driver.reading().ok);
  EXPECT_FALSE(desk.hand.firmware().latched());
}
INSTANTIATE_TEST_SUITE_P(Faults, DeviceDriverStories,
                         testing::Values(Story{FirmwareFault::kSilent, ReasonCode::kDeviceStale, 23},
                                         Story{FirmwareFault::kFrozen, ReasonCode::kDeviceStale, 23},
                                         Story{FirmwareFault::kHung, ReasonCode::kDeviceStale, 23},
                                         Story{FirmwareFault::kUnpowered, ReasonCode::kDeviceUnpowered, 60},
                                         Story{FirmwareFault::kBadCrc, ReasonCode::kDeviceReport, 5},
                                         Story{FirmwareFault::kWildCounts, ReasonCode::kDeviceReport, 5}));

TEST(DeviceDriver, SaysUnpoweredForAsLongAsNoMotorIsDrivenAndAsksForNoTorqueMeanwhile) {
  Desk desk;
  desk.torque_Nm = JointVector(0.5, 0, 0);
  desk.run(400);
  desk.hand.firmware().inject(FirmwareFault::kUnpowered);
  desk.run(100);
  for (int i = 0; i < 3000; ++i) {
    desk.tick();
    ASSERT_EQ(desk.reason(), ReasonCode::kDeviceUnpowered) << i;
  }
  desk.hand.firmware().inject(FirmwareFault::kNone);
  double most_N = 0;
  for (int i = 0; i < 90; ++i) {
    desk.tick();
    ASSERT_FALSE(desk.driver.reading().ok) << i;
    most_N = std::max(most_N, desk.hand.truth().felt_N.norm());
  }
  EXPECT_LT(most_N, 0.2) << "nothing acts before the device has been good for a while";
  desk.run(50);
  EXPECT_TRUE(desk.driver.reading().ok);
}

TEST(DeviceDriver, SaysThatADeviceThatNeverReportsHasStopped) {
  HidPair cable;
  DeviceDriver driver(desk_device(), cable.host());
  Time now{};
  for (int i = 0; i < 3000; ++i) {
    now += 1ms;
    driver.step(now);
    ASSERT_EQ(driver.reading().reason.code, i <= 1000 ? ReasonCode::kStartingUp : ReasonCode::kDeviceStale) << i;
  }
}

TEST(DeviceDriver, OneThatFellSilentHasStoppedAndIsNotStartingUp) {
  Desk desk;
  desk.run(400);
  desk.hand.firmware().inject(FirmwareFault::kSilent);
  desk.run(30);
  for (int i = 0; i < 3000; ++i) {
    desk.tick();
    ASSERT_EQ(desk.reason(), ReasonCode::kDeviceStale) << i;
  }
}

TEST(DeviceDriver, ForgivesOneDamagedReport) {
  Desk desk;
  desk.run(300);
  desk.hand.firmware().inject(FirmwareFault::kBadCrc);
  desk.run(1);
  desk.hand.firmware().inject(FirmwareFault::kNone);
  EXPECT_EQ(desk.until_refused(), 1000);
  EXPECT_EQ(desk.driver.counters().damaged, 1u);
}

TEST(DeviceDriver, SaysLostAtOnceWhenUnpluggedAndCountsTheNewAttachment) {
  Desk desk;
  desk.torque_Nm = JointVector(0.5, 0, 0);
  desk.run(300);
  const auto attachments = desk.driver.reading().attachments;
  desk.cable.unplug();
  EXPECT_LE(desk.until_refused(), 1);
  EXPECT_EQ(desk.reason(), ReasonCode::kDeviceLost);
  desk.run(600);
  EXPECT_LT(desk.hand.truth().motor_torque_Nm.norm(), 0.02);  // by the firmware's own watchdog
  desk.cable.plug();
  desk.run(300);
  EXPECT_TRUE(desk.driver.reading().ok);
  EXPECT_EQ(desk.driver.reading().attachments, attachments + 1);
}

TEST(DeviceDriver, TakesBackOnlyTheDeviceItKnowsBySerialNumber) {
  HidPair cable;
  DeviceDriver driver(desk_device(), cable.host());
  Time now{};
  const auto run = [&](std::uint32_t serial) {
    sim::HandAndDevice hand(desk_device(), steady_limb(), cable.device(), 1, kMidPosture, serial);
    for (int i = 0; i < 400; ++i) {
      now += 1ms;
      cable.advance();
      hand.step(now, {});
      driver.step(now);
      driver.command(JointVector::Zero());
    }
    const DeviceReading reading = driver.reading();
    cable.unplug();
    driver.step(now += 1ms);
    cable.plug();
    return reading;
  };
  EXPECT_TRUE(run(77).ok);
  EXPECT_EQ(run(78).reason.code, ReasonCode::kDeviceIdentity);
  EXPECT_TRUE(run(77).ok);
}

TEST(DeviceDriver, ANewProgramIsObeyedByADeviceThatAnOldOneLeftInTorqueMode) {
  Desk desk;
  desk.torque_Nm = JointVector(0.5, 0, 0);
  desk.run(1000);                  // commands 1 to 1000
  for (int i = 0; i < 100; ++i) {  // killed
    desk.now += 1ms;
    desk.cable.advance();
    desk.hand.step(desk.now, desk.intent);
  }
  ASSERT_TRUE(desk.hand.firmware().latched());
  DeviceDriver next(desk_device(), desk.cable.host());  // counts from 1 again
  for (int i = 0; i < 400; ++i) {
    desk.now += 1ms;
    desk.cable.advance();
    desk.hand.step(desk.now, desk.intent);
    next.step(desk.now);
    next.command(JointVector::Zero());
  }
  EXPECT_TRUE(next.reading().ok);
  EXPECT_FALSE(desk.hand.firmware().latched());
}

TEST(DeviceDriver, TellsOldReportsByDeviceTimeAfterAStall) {
  // The host sleeps; a ring keeps the oldest 64 reports and loses the newest.
  Desk desk;
  desk.run(300);
  for (int i = 0; i < 200; ++i) {
    desk.now += 1ms;
    desk.hand.step(desk.now, desk.intent);
  }
  desk.now += 1ms;
  desk.cable.advance();
  desk.driver.step(desk.now);
  EXPECT_EQ(desk.reason(), ReasonCode::kDeviceStale);
  EXPECT_NEAR(double(desk.driver.reading().reason.value), 137, 5);  // ms: the newest it holds is this old
  desk.run(300);
  EXPECT_TRUE(desk.driver.reading().ok);
}

TEST(DeviceDriver, SendsModeOffWhileTheDeviceIsNotOk) {
  HidPair cable;
  DeviceDriver driver(desk_device(), cable.host());
  driver.step(Time{} + 1ms);
  driver.command(JointVector(1, 1, 1));
  cable.advance();
  HidReport report;
  ASSERT_TRUE(cable.device().read(report));  // describe
  ASSERT_TRUE(cable.device().read(report));
  const auto command = decode_command(report);
  ASSERT_TRUE(command);
  EXPECT_EQ(command->mode, TorqueMode::kOff);
  EXPECT_EQ(command->torque_permille[0], 0);
}

}  // namespace
}  // namespace knuckle::master
