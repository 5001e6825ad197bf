// [[bus.broadcast]]: frames that the machine sends by itself, as the file has them.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "machine/bus_budget.h"
#include "machine/encoder_length.h"
#include "machine/reason_text.h"
#include "tests/support/multiplexed_machine.h"
#include "tests/support/refused_changes.h"

namespace knuckle {
namespace {

using test::broadcast_machine;
using test::multiplexed_machine;

TEST(BroadcastFile, SaysWhereEachValueIsAndWhatItMeans) {
  const BusDescription bus = broadcast_machine().bus;
  ASSERT_EQ(bus.broadcasts.size(), 3U);
  const auto [front, boom] = bus.broadcast(NodeRole::kEncoder, kBoom);
  ASSERT_NE(boom, nullptr);
  EXPECT_EQ(front->name, "front_angle");
  EXPECT_EQ(front->id, 0x18FF1021U | kExtendedId);
  EXPECT_EQ(front->period_s, 0.01);
  // 0.12 - (raw * 0.0004 - 10)
  EXPECT_NEAR(value_of(boom->bits, 25000), 0.12, 1e-12);
  EXPECT_NEAR(value_of(boom->bits, 25001), 0.1196, 1e-12);
  const BroadcastField bucket = *bus.broadcast(NodeRole::kEncoder, kBucket).field;
  const CanFrame frame{.id = front->id, .size = 8, .data = {0, 0, 0, 0, 0xFF, 0x38, 0, 0}};  // -200
  EXPECT_NEAR(read_value(bucket.bits, frame).value(), -2 * std::numbers::pi / 180, 1e-12);
  const auto [pressures, rod] = bus.broadcast(NodeRole::kPressure, 3);
  EXPECT_EQ(pressures->name, "pressure_1");
  EXPECT_NEAR(value_of(rod->bits, 51), 2e5, 1e-6) << "51 * 0.2 MPa - 10 MPa";
  EXPECT_EQ(rod->invalid_from, 0xFBU);
  EXPECT_EQ(bus.broadcast(NodeRole::kTilt, 0).frame->id, 0x1A5U) << "11 bits are not flagged";
  EXPECT_TRUE(bus.measures_angle(kArm));
  EXPECT_EQ(bus.broadcast(NodeRole::kValve, kArm).field, nullptr);
}

TEST(BroadcastFile, HasSmallIdentifiersOf29BitsWhereItSaysSo) {
  EXPECT_EQ(broadcast_machine("id = 0x1A5", "id = 0x1A5\nextended = true").bus.broadcasts[2].id, 0x1A5U | kExtendedId);
}

TEST(BroadcastFile, StepsOfLengthsFollowFromTheFields) {
  const MachineDescription machine = broadcast_machine();
  const JointVector steps_m = length_steps_m(machine);
  for (int joint = 0; joint < kJoints; ++joint) {
    EXPECT_GT(steps_m[joint], 0.1 * 0.00017) << joint << ": by the longest lever";
    EXPECT_LT(steps_m[joint], 0.5 * 0.0004) << joint;
  }
  EXPECT_GT(steps_m[kBoom], steps_m[kBucket]);
}

TEST(BroadcastFile, TheBusBudgetCountsItsFrames) {
  MachineDescription machine = broadcast_machine();
  const double all = worst_bus_load(machine.bus);
  machine.bus.broadcasts.clear();
  // At worst 160 bits with 8 bytes, 140 with 6 (29 bits of identifier); 95 with 4 bytes.
  EXPECT_NEAR(all - worst_bus_load(machine.bus), (100 * 160 + 100 * 140 + 50 * 95) / 500e3, 1e-9);
}

TEST(BroadcastFile, ReasonsNameTheSignalAndItsFrame) {
  const BusDescription bus = broadcast_machine().bus;
  const Reason stale{ReasonCode::kSensorStale, subject_of(NodeRole::kPressure, 2, bus), 60, 50};
  EXPECT_EQ(subject_text(stale, bus), "pressure_1 (0x18FF2021), arm_head_pressure");
  EXPECT_EQ(node_of(stale, bus), nullptr);
}

TEST(BroadcastFile, WhatCannotBeIsRefusedInOneLine) {
  test::expect_refused(
      {
          {"start = 0, bits = 16, scale", "start = 56, bits = 16, scale",
           "key 'bus.broadcast[0].signals.boom_angle.start' = 56: with 16 bits it ends outside the frame's 8 "
           "bytes"},
          {"arm_angle = { start = 16", "arm_angle = { start = 8", "has bits of arm_angle"},
          {"scale = 0.0004", "scale = 0", "boom_angle.scale' = 0: must not be 0"},
          {"unit = \"rad\"", "unit = \"bar\"", "must be one of"},
          {"arm_angle = { start = 16, bits = 16, scale = 0.0004, offset = -10, unit = \"rad\"",
           "boom_length = { start = 16, bits = 16, scale = 0.0004, unit = \"m\"",
           "'front_angle' has boom_angle: of a joint's length and angle there must be one"},
          {"arm_angle", "arm_speed", "signals.arm_speed"},
          {"arm_angle", "arm_spool", "is no signal that is measured"},
          {"bits = 16, order = \"big\", type = \"signed\"", "bits = 16, order = \"big\", type = \"float\"",
           "must be 32 or 64 of a float"},
          {"sign = -1", "sign = 0", "must be 1 or -1"},
          {"period_ms = 20", "period_ms = 30", "must be at most 25, half of bus.sensor_age_limit_ms"},
          {"id = 0x1A5", "id = 0x18FF1021", "is taken by 'front_angle'"},
          {"id = 0x1A5", "id = 0x190", "taken by 'body'"},
          {"id = 0x1A5", "id = 0x5C0", "has 0x5C0, the identifier of a service of 'enable'"},
          {"id = 0x1A5", "id = 0x080", "has 0x080, the identifier of SYNC"},
          {"id = 0x1A5", "id = 0x20000000", "must be a whole number within [0, 536870911]"},
          {"id = 0x18FF1021", "id = 0x18FF1021\nextended = false", "must be true: id is above 0x7FF"},
          {"name = \"body\"", "name = \"front_angle\"", "is the name of another frame"},
          {"scale = 0.2, offset = -10, unit = \"MPa\"", "scale = 0.4, offset = -10, unit = \"MPa\"",
           "is 4 bar a step: must be at most sensors.pressure_step_bar, 2"},
          {"invalid_from = 0xFB", "invalid_from = 0xC0",
           "reach 282 bar: must reach 385, 1.1 times sensors.pressure_range_bar"},
          {"invalid_from = 0xFB", "invalid_from = 0x100", "must be a whole number within [1, 255]"},
          {"arm_angle = { start = 16, bits = 16, scale = 0.0004", "arm_angle = { start = 16, bits = 16, scale = 0.4",
           "scale' = 0.4: must be at most 0.0122718463 a step"},
          {"modulus = 15", "modulus = 17", "must be a whole number within [2, 16]"},
          {"counter = { start = 16", "counter = { start = 8", "has bits of slope"},
          {"start = 24, bits = 8, data_id", "start = 16, bits = 8, data_id", "has bits of the counter"},
          {"data_id = [0x5A]", "bytes = [0, 1, 2, 3]", "have the checksum's own: it cannot cover itself"},
          {"crc8-j1850", "crc8", "must be one of"},
          {"start = 24, bits = 8, data_id", "start = 24, bits = 7, data_id", "must be 8 of a CRC"},
          {"slope = {", "boom_head_pressure = {", "boom_head_pressure"},
          {"slope = { start = 0, bits = 16, type = \"signed\", scale = 0.01, unit = \"deg\" }\n", "",
           "must have at least one signal"},
          {"scale = 0.01, unit = \"deg\" }\n\n", "scale = 0.01, unit = \"deg\", hidden = 1 }\n\n", "hidden"},
      },
      broadcast_machine);
}

// Several frames under one identifier.

TEST(MultiplexedFile, SaysWhichFramesOfAnIdentifierHaveAValue) {
  const BusDescription bus = multiplexed_machine().bus;
  const BroadcastFrame &angles = bus.broadcasts.at(0), &pressures = bus.broadcasts.at(1);
  EXPECT_EQ(angles.id, pressures.id);
  EXPECT_EQ(pressures.name, "pressure_1");
  const CanFrame first{angles.id, 8, {0, 0, 0, 0, 0, 0, 0, 1}}, third{angles.id, 8, {0, 0, 0, 0, 0, 0, 0, 3}},
      cut{angles.id, 7, {}};
  EXPECT_TRUE(angles.is_in(first) && !pressures.is_in(first));
  EXPECT_FALSE(angles.is_in(third) || pressures.is_in(third)) << "one that the file does not have";
  EXPECT_FALSE(angles.is_in(cut)) << "without the multiplexer";
}

TEST(MultiplexedFile, WhatDoesNotTellFramesApartIsRefusedInOneLine) {
  test::expect_refused(
      {
          {"value = 2", "value = 1", "bus.broadcast[1].multiplexer'"},
          {"value = 2", "value = 1", "has value 1, as that of 'front_angle'"},
          {"value = 2", "value = 256", "must be a whole number within [0, 255]"},
          {"multiplexer = { start = 56, bits = 8, value = 2 }\n", "",
           "is taken by 'front_angle': both must have a multiplexer"},
          {"multiplexer = { start = 56, bits = 8, value = 1 }\n", "",
           "is taken by 'front_angle': both must have a multiplexer"},
          {"start = 56, bits = 8, value = 2", "start = 52, bits = 8, value = 2",
           "must have the bits of that of 'front_angle'"},
          {"start = 56, bits = 8, value = 1", "start = 8, bits = 8, value = 1", "has bits of the multiplexer"},
          {"start = 56, bits = 8, value = 1", "start = 48, bits = 8, value = 1", "has bits of the multiplexer"},
          {"start = 56, bits = 8, value = 1", "start = 0, bits = 32, type = \"float\", value = 1",
           "must be at most 32 of an unsigned"},
          {"counter = { start = 48, bits = 4 }\n", "", "must be as of 'front_angle', which has the same identifier"},
          {"bytes = 8\nperiod_ms = 10\nmultiplexer = { start = 56, bits = 8, value = 2 }",
           "bytes = 7\nperiod_ms = 10\nmultiplexer = { start = 40, bits = 8, value = 2 }",
           "must be 8, as of 'front_angle' under the same identifier"},
      },
      multiplexed_machine);
}

}  // namespace
}  // namespace knuckle
