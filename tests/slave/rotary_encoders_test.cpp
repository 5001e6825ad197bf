// Rotary encoders on the joints: set up, read, judged and preset; above the wire there are lengths.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "machine/kinematics.h"
#include "slave/node_setup.h"
#include "slave/sensors.h"
#include "tests/slave/jog_bench.h"
#include "tests/support/says.h"

namespace knuckle::slave {
namespace {

using test::BenchMachine;

constexpr double kTurn = 2 * std::numbers::pi;
constexpr canopen::Object kOffset{0x6509, 0};

/// 0x30 to 0x32; the boom's begins a new turn within its range.
MachineDescription machine_with_rotary_encoders() {
  MachineDescription machine = test::test_machine();
  machine.sensors.encoder_step_m = 0;
  constexpr std::array kMounted{RotaryDescription{.steps_per_turn = 16384, .sign = -1, .zero_rad = 0.4},
                                RotaryDescription{.steps_per_turn = 16384, .turns = 4096, .zero_rad = -3.1},
                                RotaryDescription{.steps_per_turn = 65536, .sign = -1, .zero_rad = 2}};
  for (NodeDescription& node : machine.bus.nodes) {
    if (node.role != NodeRole::kEncoder) continue;
    ++node.channels[0].signal;  // the angle is next to the length
    node.rotary = kMounted[static_cast<std::size_t>(node.joint())];
  }
  return machine;
}

/// By the definition of sign and zero.
CanFrame counted(const MachineDescription& machine, int joint, double angle_rad) {
  const NodeDescription& node = machine.bus.encoder(joint);
  const double turns = node.rotary.sign * (angle_rad - node.rotary.zero_rad) / kTurn;
  const double steps = std::round((turns - std::floor(turns)) * node.rotary.steps_per_turn);
  const auto raw = static_cast<std::uint32_t>(steps) % node.rotary.steps_per_turn;
  CanFrame frame{.id = node.tpdo_id(), .size = 4, .data = {}};
  for (std::size_t byte = 0; byte < 4; ++byte) frame.data[byte] = static_cast<std::uint8_t>(raw >> (8 * byte));
  return frame;
}

/// Fed with frames at 200 Hz, all other sensors well.
struct FedSensors {
  void feed(double boom_rad, int times = 1) {
    for (int n = 0; n < times; ++n) {
      now += 5ms;
      for (std::uint32_t i = 0; i < 6; ++i)
        sensors.receive({.id = 0x1A0U + i, .size = 5, .data = {0x88, 0x13, 0, 0, 0}}, now);
      sensors.receive(counted(machine, kBoom, boom_rad), now);
      sensors.receive(counted(machine, kArm, -1.5), now);
      sensors.receive(counted(machine, kBucket, -0.8), now);
      sensors.receive({.id = 0x1B8, .size = 2, .data = {}}, now);
    }
  }
  MachineDescription machine = machine_with_rotary_encoders();
  SensorSet sensors{machine};
  Kinematics kinematics{machine};
  Time now{1s};
};

TEST(RotaryEncoders, AreReadAsLengthsThroughoutTheJointsRange) {
  FedSensors fed;
  const LinkDescription& boom = fed.machine.links[kBoom];
  for (double angle = boom.min_rad; angle < boom.max_rad; angle += 0.005) {
    fed.feed(angle);
    ASSERT_FALSE(fed.sensors.fault(fed.now)) << angle << ": " << text(fed.sensors.fault(fed.now));
    ASSERT_FALSE(fed.sensors.unreachable());
    const auto measured = fed.sensors.measurement();
    ASSERT_TRUE(measured);
    const CylinderState drawn = fed.kinematics.cylinder_at(kBoom, angle).value();
    EXPECT_NEAR(measured->cylinder_m[kBoom], drawn.length_m, 0.51 * kTurn / 16384 * std::abs(drawn.lever_m));
  }
}

TEST(RotaryEncoders, JumpsAndAnglesOutsideTheJointAreNotBelieved) {
  FedSensors fed;
  fed.feed(0.3);
  fed.feed(0.4, 3);
  EXPECT_TRUE(test::is(fed.sensors.fault(fed.now), ReasonCode::kSensorInvalid, 0x30)) << "0.1 rad at once";
  EXPECT_NEAR(fed.sensors.measurement()->cylinder_m[kBoom], fed.kinematics.cylinder_at(kBoom, 0.3)->length_m, 2e-4);
  FedSensors out;
  out.feed(0.3);
  out.feed(3, 3);
  EXPECT_TRUE(test::is(out.sensors.fault(out.now), ReasonCode::kSensorInvalid));
  EXPECT_NEAR(std::remainder(out.sensors.fault(out.now).value - 3, kTurn), 0, 1e-3) << "the angle is told";
  EXPECT_FALSE(FedSensors().sensors.measurement());
}

TEST(RotaryEncoders, AreSetUpAndEngage) {
  BenchMachine m(machine_with_rotary_encoders());
  m.nodes.node(0x30)->remove(canopen::kEncoderRange);  // of a single turn: need not say how far it counts
  ASSERT_TRUE(m.engage()) << m.setup_failure();
  m.run(500ms);
  const auto measured = m.loop.sensors().measurement().value();
  for (int i = 0; i < kJoints; ++i) EXPECT_NEAR(measured.cylinder_m[i], m.signals.cylinder_m[i], 3e-4) << i;
  EXPECT_FALSE(m.loop.fault()) << text(m.loop.fault());
}

TEST(RotaryEncoders, OfAnotherNumberOfStepsAreRefused) {
  struct Case {
    std::uint8_t node;
    canopen::Object object;
    const char* said;
  };
  for (const Case& c :
       {Case{0x32, canopen::kEncoderStepsPerTurn, "0x6001:00 gave 0x2000, the machine file says 0x10000"},
        {0x31, canopen::kEncoderRange, "0x6002:00 gave 0x2000, the machine file says 0x4000000"}}) {
    BenchMachine m(machine_with_rotary_encoders());
    m.nodes.node(c.node)->replace(c.object, 8192);
    EXPECT_FALSE(m.engage());
    EXPECT_TRUE(test::says(m.setup_failure(), c.said));
  }
}

/// 0x6003 of the preset.
std::uint32_t preset_steps(const MachineDescription& machine, int joint, double length_m) {
  const SdoScript script = preset_script(machine, joint, length_m);
  EXPECT_EQ(script[0].written[0].object, canopen::kEncoderPreset);
  return script[0].written[0].value;
}

TEST(RotaryEncoders, APresetIsWhatTheyCountWhereTheCylinderHasThisLength) {
  const MachineDescription machine = machine_with_rotary_encoders();
  const Kinematics kinematics(machine);
  for (int joint = 0; joint < kJoints; ++joint) {
    const LinkDescription& link = machine.links[static_cast<std::size_t>(joint)];
    for (double angle = link.min_rad; angle < link.max_rad; angle += 0.01) {
      const CanFrame frame = counted(machine, joint, angle);
      const auto steps = static_cast<std::uint32_t>(frame.data[0] | frame.data[1] << 8);
      EXPECT_EQ(preset_steps(machine, joint, kinematics.cylinder_at(joint, angle)->length_m), steps) << angle;
    }
  }
  const double just_before = machine.bus.encoder(kBoom).rotary.zero_rad + 1e-6;  // a whole turn less a hair
  EXPECT_EQ(preset_steps(machine, kBoom, kinematics.cylinder_at(kBoom, just_before)->length_m), 0U);
  EXPECT_THROW((void)preset_script(machine, kBoom, 2.5), InputError);
}

TEST(RotaryEncoders, BeforeAnythingMovesTheyAreReadAndPreset) {
  JogBench rig(machine_with_rotary_encoders());
  const JointVector& length_m = rig.bench.signals.cylinder_m;
  rig.bench.nodes.node(0x30)->replace(kOffset, 5000);  // mounted as it came: an angle that the boom cannot have
  ASSERT_NO_FATAL_FAILURE(rig.start());
  EXPECT_EQ(rig.jog.sensors().no_length, (std::array{true, false, false}));
  EXPECT_NEAR(rig.jog.sensors().length_m[kArm], length_m[kArm], 3e-4);
  rig.jog.hold_pilot(100ms);
  rig.run(50ms);
  EXPECT_TRUE(test::is(rig.jog.trouble(), ReasonCode::kSensorInvalid, 0x30))
      << "no pilot pressure where an angle says nothing";
  rig.jog.write_objects(0x30, preset_script(rig.bench.description, kBoom, length_m[kBoom]));
  rig.run(200ms);
  EXPECT_EQ(rig.jog.sensors().no_length, (std::array{false, false, false}));
  EXPECT_NEAR(rig.jog.sensors().length_m[kBoom], length_m[kBoom], 3e-4);
}

}  // namespace
}  // namespace knuckle::slave
