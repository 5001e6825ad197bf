// Values that cannot be are left out and named; what is left ages.
#include "slave/sensors.h"

#include <gtest/gtest.h>

#include "machine/kinematics.h"
#include "tests/slave/reasons.h"
#include "tests/slave/test_machine.h"
#include "tests/support/sensor_frames.h"
#include "transport/canopen.h"

namespace knuckle::slave {
namespace {

class Sensors : public ::testing::Test {
 public:
  void send_all(double arm_m = 1.1) {
    for (std::uint8_t i = 0; i < 6; ++i) pressure(i, 50e5 + i * 1e5);
    lengths(0.9, arm_m, 0.9);
    tilt(0.02);
  }
  void send_all_but_tilt() {
    for (std::uint8_t i = 0; i < 6; ++i) pressure(i, 50e5);
    lengths(0.9, 1.1, 0.9);
  }
  void send_next(double arm_m) {
    now += 5ms;
    send_all(arm_m);
  }
  void pressure(std::uint8_t i, double Pa, std::uint8_t status = 0) {
    sensors.receive(canopen::pressure_frame(0x1A0U + i, {Pa, status}), now);
  }
  void length(std::uint8_t i, double m) { sensors.receive(canopen::encoder_frame(0x1B0U + i, {m, 0}), now); }
  void lengths(double boom_m, double arm_m, double bucket_m) {
    length(0, boom_m);
    length(1, arm_m);
    length(2, bucket_m);
  }
  void tilt(double rad) { sensors.receive(canopen::tilt_frame(0x1B8, rad), now); }

  Time now{1s};
  MachineDescription machine = test::test_machine();
  SensorSet sensors{machine};
};

TEST_F(Sensors, MeasurementNeedsEverySensorOnce) {
  EXPECT_FALSE(sensors.measurement());
  EXPECT_TRUE(test::is(sensors.fault(now), ReasonCode::kSensorStale));
  send_all();
  const auto m = sensors.measurement().value();
  EXPECT_NEAR(m.pressure_Pa[5], 55e5, 1);
  EXPECT_NEAR(m.cylinder_m[kArm], 1.1, 1e-9);
  EXPECT_NEAR(m.hull_pitch_rad, 0.02, 0.001);
  EXPECT_FALSE(sensors.fault(now));
}

TEST(SensorSteps, LengthsAndSlopesAreCountedInTheMachineFilesSteps) {
  MachineDescription fine = test::test_machine();
  fine.sensors.encoder_step_m = 3e-5;
  fine.sensors.tilt_step_rad = 0.01 * 0.017453292519943295;
  SensorSet sensors(fine);
  for (std::uint8_t i = 0; i < 6; ++i) sensors.receive(canopen::pressure_frame(0x1A0U + i, {50e5, 0}), Time{1s});
  // 30000, 36667 and 30000 steps; 115 steps.
  const std::array<CanFrame, 3> lengths{{{0x1B0, 6, {0x30, 0x75, 0, 0, 0, 0}},
                                         {0x1B1, 6, {0x3B, 0x8F, 0, 0, 0, 0}},
                                         {0x1B2, 6, {0x30, 0x75, 0, 0, 0, 0}}}};
  for (const CanFrame& frame : lengths) sensors.receive(frame, Time{1s});
  sensors.receive({0x1B8, 2, {115, 0}}, Time{1s});
  const auto m = sensors.measurement().value();
  EXPECT_NEAR(m.cylinder_m[kBoom], 0.9, 1e-9);
  EXPECT_NEAR(m.cylinder_m[kArm], 1.10001, 1e-9);
  EXPECT_NEAR(m.hull_pitch_rad, 1.15 * 0.017453292519943295, 1e-9);
}

TEST(SensorOffsets, CalibratedOffsetsAreTakenOffAndLengthsAreJudgedWithoutThem) {
  MachineDescription machine = test::test_machine();
  machine.sensors.encoder_offset_m = JointVector(0.030, -0.020, 0);
  const auto with_boom = [&machine](double boom_m) {
    SensorSet sensors(machine);
    for (std::uint8_t i = 0; i < 6; ++i) sensors.receive(canopen::pressure_frame(0x1A0U + i, {50e5, 0}), Time{1s});
    sensors.receive(canopen::tilt_frame(0x1B8, 0), Time{1s});
    std::uint8_t encoder = 0;
    for (const double length_m : {boom_m, 1.08, 0.90})
      sensors.receive(canopen::encoder_frame(0x1B0U + encoder++, {length_m, 0}), Time{1s});
    return sensors.measurement();
  };
  const auto longest = with_boom(1.18);  // 1.15 m: all of its stroke
  ASSERT_TRUE(longest);
  EXPECT_NEAR(longest->cylinder_m[kBoom], 1.15, 1e-9);
  EXPECT_NEAR(longest->cylinder_m[kArm], 1.10, 1e-9);
  EXPECT_NEAR(longest->cylinder_m[kBucket], 0.90, 1e-9);
  EXPECT_TRUE(with_boom(0.78));
  EXPECT_FALSE(with_boom(0.75)) << "0.72 m: shorter than this cylinder can be";
}

TEST_F(Sensors, OldestSensorIsNamedOnceItIsOlderThanItsLimit) {
  send_all();
  now += 10ms;
  send_all();
  now += 20ms;
  for (std::uint8_t i = 0; i < 6; ++i) {
    if (i != 3) pressure(i, 50e5);
  }
  lengths(0.9, 1.1, 0.9);
  tilt(0.02);
  now += 5ms;
  EXPECT_FALSE(sensors.fault(now));
  now += 1us;
  EXPECT_TRUE(test::is(sensors.fault(now), ReasonCode::kSensorStale, 0x23));
  EXPECT_EQ(sensors.oldest_node(), 0x23);
}

// It comes with every second SYNC, so that two of it are missed where others have missed four.
TEST_F(Sensors, ASlopeMayBeOlderThanTheOthersByAsMuchAsItsNextOneIsLater) {
  send_all();
  now += 25ms;
  send_all_but_tilt();
  now += 5ms;
  EXPECT_FALSE(sensors.fault(now));
  now += 1us;
  EXPECT_TRUE(test::is(sensors.fault(now), ReasonCode::kSensorStale, 0x38));
  EXPECT_FLOAT_EQ(sensors.fault(now).limit, 30);
}

TEST_F(Sensors, ImpossibleValuesAreLeftOutAndThreeInARowAreAFault) {
  const auto bad_values = {+[](Sensors& s) { s.pressure(2, 50e5, canopen::kPressureInvalid); },
                           +[](Sensors& s) { s.pressure(2, 421e5); },
                           +[](Sensors& s) { s.pressure(2, -4e5); },
                           +[](Sensors& s) { s.length(1, 0.80); },
                           +[](Sensors& s) { s.length(1, 214748.0); },
                           +[](Sensors& s) { s.length(1, 1.13); },  // in range, but 3 cm in 5 ms
                           +[](Sensors& s) { s.tilt(1.0); }};
  for (const auto& bad : bad_values) {
    sensors.restart();
    send_all();
    for (int i = 0; i < 3; ++i) {
      EXPECT_FALSE(sensors.fault(now)) << i;
      now += 5ms;
      pressure(0, 50e5);  // the others go on
      bad(*this);
      EXPECT_NEAR(sensors.measurement()->cylinder_m[1], 1.1, 1e-6);
      EXPECT_NEAR(sensors.measurement()->pressure_Pa[2], 52e5, 1);
    }
    EXPECT_TRUE(test::is(sensors.fault(now), ReasonCode::kSensorInvalid));
  }
}

TEST_F(Sensors, AFrameShorterThanMappedIsNotUsedAndThreeInARowAreNamedWithTheirBytes) {
  const std::pair<CanFrame, float> short_frames[] = {
      {{0x1A2, 4, {1, 2, 3, 4}}, 5}, {{0x1B1, 4, {1, 2, 3, 4}}, 6}, {{0x1B8, 1, {1}}, 2}, {{0x1A2, 0, {}}, 5}};
  for (const auto& [frame, mapped] : short_frames) {
    sensors.restart();
    send_all();
    for (int i = 0; i < 3; ++i) {
      EXPECT_FALSE(sensors.fault(now)) << i;
      sensors.receive(frame, now);
    }
    const int node = static_cast<int>(frame.id - 0x180);
    test::expect_reason(sensors.fault(now), ReasonCode::kFrameShort, node, frame.size, mapped, 0);
    EXPECT_NEAR(sensors.measurement()->cylinder_m[1], 1.1, 1e-6);
    send_all();
    EXPECT_FALSE(sensors.fault(now)) << "whole again";
  }
  for (int i = 0; i < 3; ++i) pressure(2, 421e5);
  EXPECT_TRUE(test::is(sensors.fault(now), ReasonCode::kSensorInvalid)) << "what was short before is forgotten";
}

TEST_F(Sensors, OfAFrameLongerThanMappedTheFirstBytesAreUsed) {
  send_all();
  CanFrame longer = canopen::encoder_frame(0x1B1, {1.1005, 0});
  longer.size = 8;
  longer.data[6] = longer.data[7] = 0xFF;
  sensors.receive(longer, now);
  EXPECT_NEAR(sensors.measurement()->cylinder_m[1], 1.1005, 1e-6);
  EXPECT_FALSE(sensors.fault(now));
}

TEST_F(Sensors, LengthWithoutAJointAngleIsNamedByItsOwnEncoder) {
  send_all();
  EXPECT_FALSE(sensors.unreachable());
  const double at_the_toggle_m = 1.105;  // the cylinder could be as long, its linkage not
  sensors = SensorSet(machine);
  length(2, at_the_toggle_m);
  const Reason reason = sensors.unreachable();
  EXPECT_TRUE(test::is(reason, ReasonCode::kSensorInvalid, 0x32));
  EXPECT_NEAR(reason.value, at_the_toggle_m, 1e-4);
}

TEST_F(Sensors, RestartForgetsEverythingButWhereTheLengthsWere) {
  send_all();
  now += 5s;
  sensors.restart();
  EXPECT_FALSE(sensors.measurement());
  send_all();
  EXPECT_FALSE(sensors.fault(now)) << "back where it was";
  now += 5s;
  sensors.restart();
  for (int i = 0; i < 3; ++i) send_next(1.13);
  EXPECT_TRUE(test::is(sensors.fault(now), ReasonCode::kSensorInvalid, 0x31));
  EXPECT_NEAR(sensors.measurement()->cylinder_m[kArm], 1.1, 1e-9);
}

TEST_F(Sensors, LengthThatJumpedCountsOnceItIsToldToAndHasStoodStill) {
  send_all();
  const Reason of_arm{ReasonCode::kLengthElsewhere, 0x31, 0, 0};
  for (int i = 0; i < 190; ++i) send_next(1.14);
  sensors.believe_settled_length(of_arm, now);
  send_next(1.14);
  EXPECT_TRUE(test::is(sensors.fault(now), ReasonCode::kSensorInvalid)) << "not yet a second";
  for (int i = 0; i < 400; ++i) send_next(1.14 + 1e-4 * i);  // still moves: 2 cm/s
  sensors.believe_settled_length(of_arm, now);
  send_next(1.18);
  EXPECT_TRUE(test::is(sensors.fault(now), ReasonCode::kSensorInvalid));
  for (int i = 0; i < 400; ++i) send_next(1.5);  // no length of this cylinder
  sensors.believe_settled_length(of_arm, now);
  send_next(1.5);
  EXPECT_TRUE(test::is(sensors.fault(now), ReasonCode::kSensorInvalid));
  for (int i = 0; i < 201; ++i) send_next(1.16);
  EXPECT_TRUE(test::is(sensors.fault(now), ReasonCode::kLengthElsewhere)) << "not by waiting";
  sensors.believe_settled_length({ReasonCode::kLengthElsewhere, 0x30, 0, 0}, now);
  EXPECT_TRUE(test::is(sensors.fault(now), ReasonCode::kLengthElsewhere)) << "not by another's answer";
  sensors.believe_settled_length(of_arm, now);
  send_next(1.16);
  EXPECT_FALSE(sensors.fault(now));
  EXPECT_NEAR(sensors.measurement()->cylinder_m[kArm], 1.16, 1e-6);
}

class BoomTilt : public Sensors {
 public:
  BoomTilt() {
    machine.sensors.tilt_mount = SensorDescription::TiltMount::kOnBoom;
    sensors = SensorSet(machine);
    send_all_but_tilt();
  }
  void slope(double hull_rad) {
    now += 5ms;
    tilt(Kinematics(machine).joint_at(kBoom, 0.9).value() + hull_rad);
  }
  void slopes(double hull_rad, int times) {
    for (int i = 0; i < times; ++i) slope(hull_rad);
  }
  [[nodiscard]] double pitch() const { return sensors.measurement()->hull_pitch_rad; }
};

TEST_F(BoomTilt, GivesTheHullPitch) {
  slope(0.05);
  EXPECT_NEAR(pitch(), 0.05, 0.001);
  slopes(-0.05, 250);
  EXPECT_NEAR(pitch(), -0.05, 0.001) << "a hull that turns is followed";
}

TEST_F(BoomTilt, AJerkOfTheBoomIsNeitherAFaultNorALeaningHull) {
  slope(0.02);
  slopes(1.4, 30);  // the felt vertical lies over for 0.15 s
  EXPECT_NEAR(pitch(), 0.02, 0.016);
  EXPECT_NE(sensors.fault(now).code, ReasonCode::kSensorInvalid);
  slopes(0.02, 40);
  EXPECT_NEAR(pitch(), 0.02, 0.001);
}

TEST_F(BoomTilt, ASlopeThatStaysImpossibleIsAFault) {
  slope(0.02);
  slopes(1.4, 70);
  EXPECT_TRUE(test::is(sensors.fault(now), ReasonCode::kSensorInvalid));
}

TEST_F(BoomTilt, WhatDevicesSendForBrokenIsAFaultAtOnce) {
  slope(0.02);
  for (int i = 0; i < 3; ++i) tilt(32767 * canopen::kTiltStep_rad);
  EXPECT_TRUE(test::is(sensors.fault(now), ReasonCode::kSensorInvalid));
}

}  // namespace
}  // namespace knuckle::slave
