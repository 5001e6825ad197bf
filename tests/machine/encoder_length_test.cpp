// Angles of rotary encoders as lengths of cylinders.
#include "machine/encoder_length.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "machine/bus_frames.h"
#include "machine/toml_reader.h"
#include "tests/support/replaced.h"
#include "tests/support/rotary_machine.h"
#include "tests/support/says.h"
#include "tests/support/shipped.h"
#include "transport/signal_codec.h"

namespace knuckle {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

MachineDescription rotary_machine() {
  return parse_machine(test::rotary_text(), "m.toml");
}

/// From where the pins are, and no law of triangles.
double drawn_length_m(const MachineDescription& machine, int joint, double angle_rad) {
  JointVector joints_rad = middle_of_range(machine);
  joints_rad[joint] = angle_rad;
  return pose_of(machine, joints_rad).cylinders[static_cast<std::size_t>(joint)].length_m();
}

double swept(const MachineDescription& machine, int joint, int i, int of) {
  const LinkDescription& link = machine.links[static_cast<std::size_t>(joint)];
  return link.min_rad + (link.max_rad - link.min_rad) * i / of;
}

BitField angle_field(const MachineDescription& machine, int joint) {
  return sent_fields(machine.bus.encoder(joint), machine).front().bits;
}

/// What an encoder counts that is mounted so, by the definition of sign and zero.
CanFrame counted(const MachineDescription& machine, int joint, double angle_rad) {
  const RotaryDescription& rotary = machine.bus.encoder(joint).rotary;
  const double turns = rotary.sign * (angle_rad - rotary.zero_rad) / kTurn;
  const auto all = static_cast<std::int64_t>(rotary.steps_per_turn) * rotary.turns;
  const auto steps = static_cast<std::uint32_t>(
      ((std::llround(turns * static_cast<double>(rotary.steps_per_turn)) % all) + all) % all);
  CanFrame frame{.id = 0x1B0, .size = 4, .data = {}};
  for (std::size_t byte = 0; byte < 4; ++byte) frame.data[byte] = static_cast<std::uint8_t>(steps >> (8 * byte));
  return frame;
}

TEST(EncoderLengths, AnAngleIsTheLengthBetweenThePinsInWhicheverTurnItIsCounted) {
  const MachineDescription machine = rotary_machine();
  const EncoderLengths lengths(machine);
  for (int joint = 0; joint < kJoints; ++joint) {
    const RotaryDescription& rotary = machine.bus.encoder(joint).rotary;
    for (int i = 0; i <= 200; ++i) {
      const double angle = swept(machine, joint, i, 200);
      const auto reading = read_value(angle_field(machine, joint), counted(machine, joint, angle)).value();
      const auto length_m = lengths.length_m(joint, reading);
      ASSERT_TRUE(length_m) << joint << " at " << angle;
      EXPECT_NEAR(*length_m, drawn_length_m(machine, joint, angle), 0.5 * rotary.step_rad() * 1.0) << joint;
      EXPECT_NEAR(std::remainder(reading - angle, kTurn), 0, 0.501 * rotary.step_rad()) << joint;
    }
  }
}

TEST(EncoderLengths, AreNoneForAnglesThatTheJointCannotHave) {
  const MachineDescription machine = rotary_machine();
  const EncoderLengths lengths(machine);
  for (int joint = 0; joint < kJoints; ++joint) {
    const LinkDescription& link = machine.links[static_cast<std::size_t>(joint)];
    const BitField field = angle_field(machine, joint);
    const auto at = [&](double angle) {
      return lengths.length_m(joint, read_value(field, counted(machine, joint, angle)).value());
    };
    EXPECT_TRUE(at(link.min_rad - 0.02)) << "pins are not where they were drawn";
    EXPECT_TRUE(at(link.max_rad + 0.02));
    const double outside = kTurn - (link.max_rad - link.min_rad);
    for (const double share : {0.3, 0.5, 0.7}) EXPECT_FALSE(at(link.max_rad + share * outside)) << joint;
    const CanFrame broken{.id = 0x1B0, .size = 4, .data = {0xFF, 0xFF, 0xFF, 0x7F}};
    EXPECT_FALSE(lengths.length_m(joint, read_value(field, broken).value())) << "more than it can count";
    EXPECT_FALSE(lengths.length_m(joint, std::numeric_limits<double>::quiet_NaN()));
  }
}

TEST(EncoderLengths, OfASingleTurnEndWithIt) {
  const MachineDescription machine = rotary_machine();
  const EncoderLengths lengths(machine);
  const RotaryDescription& boom = machine.bus.encoder(kBoom).rotary;
  const BitField field = angle_field(machine, kBoom);
  const auto at = [&](std::uint32_t steps) { return lengths.length_m(kBoom, value_of(field, steps)); };
  ASSERT_TRUE(at(0) && at(boom.steps_per_turn - 1)) << "a new turn begins within the joint's range";
  EXPECT_NEAR(*at(0), *at(boom.steps_per_turn - 1), boom.step_rad());
  EXPECT_FALSE(at(boom.steps_per_turn + 1));
}

TEST(EncoderLengths, OfWireEncodersAreWhatTheySay) {
  const MachineDescription machine = test::shipped("solar015");
  const EncoderLengths lengths(machine);
  for (const double reading : {0.9, -3.0, 1e3}) {
    EXPECT_EQ(lengths.length_m(kArm, reading), reading);
    EXPECT_EQ(lengths.reading(kArm, reading), reading);
  }
  EXPECT_EQ(length_steps_m(machine), JointVector::Constant(1e-4));
}

TEST(EncoderLengths, StayTheDrawingsWhereTheGeometryIsCalibrated) {
  const MachineDescription machine = rotary_machine();
  MachineDescription found = calibrated(machine);
  found.geometry_calibration = GeometryCalibration{.length_m = {1.76, machine.links[kArm].length_m, 0.51},
                                                   .boom_parent_pin_m = machine.boom_mount.parent_pin_m,
                                                   .boom_child_pin_m = machine.boom_mount.child_pin_m * 1.003,
                                                   .arm_parent_pin_m = machine.arm_mount.parent_pin_m,
                                                   .arm_child_pin_m = machine.arm_mount.child_pin_m,
                                                   .cylinder_pin_m = machine.bucket_linkage.cylinder_pin_m,
                                                   .rocker_pin_m = machine.bucket_linkage.rocker_pin_m,
                                                   .bucket_pin_m = machine.bucket_linkage.bucket_pin_m,
                                                   .rocker_length_m = machine.bucket_linkage.rocker_length_m,
                                                   .coupler_length_m = machine.bucket_linkage.coupler_length_m,
                                                   .encoder_offset_m = {0.001, 0, 0}};
  const MachineDescription seen = calibrated(calibrated(found));
  ASSERT_NE(seen.boom_mount.child_pin_m, machine.boom_mount.child_pin_m);
  const double angle = middle_of_range(machine)[kBoom];
  EXPECT_EQ(EncoderLengths(seen).length_m(kBoom, angle), EncoderLengths(machine).length_m(kBoom, angle));
  EXPECT_NE(Kinematics(seen).cylinder_at(kBoom, angle)->length_m, *EncoderLengths(seen).length_m(kBoom, angle));
}

TEST(EncoderLengths, AStepIsTheMostThatOneMovesTheCylinder) {
  const MachineDescription machine = rotary_machine();
  const JointVector steps_m = length_steps_m(machine);
  for (int joint = 0; joint < kJoints; ++joint) {
    const double step_rad = machine.bus.encoder(joint).rotary.step_rad();
    double most_m = 0;
    for (int i = 0; i < 2000; ++i) {
      const double angle = swept(machine, joint, i, 2000);
      most_m = std::max(
          most_m, std::abs(drawn_length_m(machine, joint, angle + step_rad) - drawn_length_m(machine, joint, angle)));
    }
    EXPECT_NEAR(steps_m[joint], most_m, 1e-3 * most_m);
  }
}

TEST(EncoderLengths, HoldForMachinesOfAnyPins) {
  const std::uint64_t seed = 11;
  std::mt19937_64 random(seed);
  const auto moved = [&](PlanarVector& pin) {
    std::uniform_real_distribution<> off(-0.03, 0.03);
    pin += PlanarVector(off(random), off(random));
  };
  int machines = 0;
  for (int tries = 0; tries < 100; ++tries) {
    MachineDescription machine = rotary_machine();
    for (PlanarVector* pin :
         {&machine.boom_mount.parent_pin_m, &machine.boom_mount.child_pin_m, &machine.arm_mount.parent_pin_m,
          &machine.arm_mount.child_pin_m, &machine.bucket_linkage.cylinder_pin_m, &machine.bucket_linkage.rocker_pin_m})
      moved(*pin);
    for (CylinderDescription& cylinder : machine.cylinders) {
      cylinder.min_length_m -= 0.1;
      cylinder.max_length_m += 0.1;
    }
    std::optional<EncoderLengths> lengths;
    try {
      lengths.emplace(machine);
    } catch (const InputError&) {
      continue;
    }
    ++machines;
    for (int joint = 0; joint < kJoints; ++joint) {
      const double angle = swept(machine, joint, static_cast<int>(random() % 101), 100);
      const auto length_m = lengths->length_m(joint, angle);
      ASSERT_TRUE(length_m) << "seed " << seed;
      EXPECT_NEAR(*length_m, drawn_length_m(machine, joint, angle), 1e-9);
      const double reading = lengths->reading(joint, *length_m).value();
      EXPECT_NEAR(std::remainder(reading - angle, kTurn), 0, 1e-8);
      const RotaryDescription& rotary = machine.bus.encoder(joint).rotary;
      const double counted = rotary.sign * (reading - rotary.zero_rad);
      EXPECT_TRUE(counted >= 0 && counted < kTurn + 1e-12) << "of the first turn: " << counted;
    }
  }
  EXPECT_GT(machines, 10);
}

/// The boom's encoder is one on a wire.
std::string with_one_wire() {
  return test::replaced(test::rotary_text(), std::string("\"boom_angle\" }\n") + test::kRotaryKeys[0],
                        "\"boom_length\" }\n");
}

TEST(RotaryEncoders, SendTheirPositionAloneAndHaveOneOfLengthAndAngle) {
  const MachineDescription machine = rotary_machine();
  int angles = 0;
  for (const BusFrame& frame : bus_frames(machine.bus, machine.sensors)) {
    if (!machine.bus.nodes[frame.node].measures_angle()) continue;
    ++angles;
    ASSERT_EQ(frame.fields.size(), 1U);
    EXPECT_EQ(frame.fields[0].object, (canopen::Object{0x6004, 0}));
    EXPECT_EQ(frame.bytes(), 4);
    EXPECT_EQ(frame.every_nth_sync, 1);
  }
  EXPECT_EQ(angles, 3);
  EXPECT_EQ(machine.bus.encoder(kArm).rotary.range(), 16384U * 4096U);
  EXPECT_EQ(machine.bus.find("arm_angle"), &machine.bus.encoder(kArm));
  const MachineDescription mixed =
      parse_machine(test::replaced(with_one_wire(), "[sensors]\n", "[sensors]\nencoder_step_mm = 0.1\n"), "m.toml");
  EXPECT_FALSE(mixed.bus.encoder(kBoom).measures_angle());
  EXPECT_DOUBLE_EQ(length_steps_m(mixed)[kBoom], 1e-4);
  EXPECT_TRUE(mixed.bus.encoder(kBucket).measures_angle());
}

/// All that is wrong with it, a line each.
std::string refusals(const std::string& text) {
  try {
    (void)parse_machine(text, "m.toml");
  } catch (const FileErrors& errors) {
    std::string all;
    for (const std::string& line : errors.lines()) all += line + '\n';
    return all;
  }
  return "";
}

TEST(RotaryEncoders, FilesThatCannotBeAreRefusedWithTheirKey) {
  struct Case {
    const char *from, *to, *said;
  };
  const Case cases[] = {
      {"\"boom_angle\"", "\"boom_length\"", "'bus.node[9].steps_per_turn' = 16384: unknown key"},
      {"1 = \"arm_angle\"", "1 = \"boom_length\"",
       "'bus.node[10].channels.1' = 'boom_length': 'boom_encoder' has boom_angle: of a joint's length and angle there "
       "must be one"},
      {"1 = \"arm_angle\"", "1 = \"boom_angle\"", "is taken by 'boom_encoder'"},
      {"profile = \"cia406\"", "profile = \"cia410\"", "must be one of \"slope\""},
      {"steps_per_turn = 16384", "steps_per_turn = 511", "steps_per_turn' = 511: must be a whole number within [512"},
      {"steps_per_turn = 16384\n", "", "key 'bus.node[9].steps_per_turn'"},
      {"turns = 4096", "turns = 0", "turns' = 0: must be a whole number within [1, 65536]"},
      {"turns = 4096", "turns = 65536\n#", ""},
      {"turns = 4096\n", "turns = 65536\nsign = 0\n", "sign' = 0: must be 1 or -1"},
      {"steps_per_turn = 16384\nturns = 4096", "steps_per_turn = 65536\nturns = 32768", ""},
      {"steps_per_turn = 16384\nturns = 4096", "steps_per_turn = 65536\nturns = 32769", "must be at most 32768"},
      {"steps_per_turn = 16384\nturns = 4096", "steps_per_turn = 65536\nturns = 65536",
       "turns' = 65536: must be at most 32768: 2^31 steps in all"},
      {"sign = -1", "sign = -2", "sign' = -2: must be 1 or -1"},
      {"zero_rad = 0.4", "zero_rad = 4", "zero_rad' = 4: must be within"},
      {"zero_rad = 0.4", "zero_deg = 0.4", "zero_deg"},
      {"1 = \"slope\" }\n", "1 = \"slope\" }\nsign = 1\n", "sign"},
      {"1 = \"boom_angle\" }", "1 = \"boom_angle\", 2 = \"arm_angle\" }",
       "channels.2' = 'arm_angle': must be channel 1"},
  };
  for (const Case& c : cases) {
    const std::string said = refusals(test::replaced(test::rotary_text(), c.from, c.to));
    if (*c.said == '\0')
      EXPECT_EQ(said, "") << c.to;
    else
      EXPECT_TRUE(test::says(said, c.said));
  }
  std::string text = test::rotary_text();
  const std::size_t begin = text.find("[[bus.node]]\nname = \"arm_encoder\""),
                    end = text.find("[[bus.node]]", begin + 1);
  EXPECT_TRUE(test::says(refusals(text.erase(begin, end - begin)), "no node has arm_length or arm_angle"));
  EXPECT_TRUE(test::says(refusals(with_one_wire()), "sensors.encoder_step_mm"));
}

}  // namespace
}  // namespace knuckle
