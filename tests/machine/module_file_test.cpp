// Modules with analogue inputs and outputs in machine files.
#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <string>

#include "core/units.h"
#include "machine/bus_frames.h"
#include "machine/load_frames.h"
#include "machine/room.h"
#include "tests/support/module_machine.h"
#include "tests/support/refused_changes.h"

namespace knuckle {
namespace {

using test::module_machine;

TEST(ModuleFile, OutputsAreCommandFrames) {
  const MachineDescription machine = module_machine();
  const BusDescription& bus = machine.bus;
  ASSERT_EQ(bus.commands.size(), 1U);
  const CommandFrame& frame = bus.commands[0];
  EXPECT_EQ(frame.name, "module_rpdo2");
  EXPECT_EQ(frame.id, 0x341U);
  EXPECT_EQ(frame.bytes, 8);
  EXPECT_EQ(frame.module, 0x41);
  EXPECT_EQ(frame.pdo, 1);
  EXPECT_DOUBLE_EQ(frame.period_s, 0.005);
  EXPECT_EQ(bus.command_kind, CommandKind::kVoltage);
  ASSERT_EQ(frame.fields.size(), 4U);
  EXPECT_EQ(frame.fields[2].bits.start_bit, 32);
  EXPECT_DOUBLE_EQ(frame.fields[2].value(0.5, true), 4.5) << "6 V less half of 3 V";
  EXPECT_DOUBLE_EQ(frame.fields[3].value(0.5, true), 6);
  EXPECT_EQ(bus.find(0x41)->outputs, 4);
  EXPECT_TRUE(bus.find(0x41)->is_told());
  EXPECT_TRUE(bus.by_frames());
  EXPECT_FALSE(bus.without_nodes());
}

TEST(ModuleFile, MoreThanFourOutputsAreTwoFrames) {
  const BusDescription bus = module_machine(test::kCurrentOutputs).bus;
  ASSERT_EQ(bus.commands.size(), 2U);
  EXPECT_EQ(bus.commands[1].id, 0x441U);
  EXPECT_EQ(bus.commands[1].bytes, 4);
  EXPECT_EQ(bus.command_kind, CommandKind::kCurrent);
  EXPECT_DOUBLE_EQ(bus.command(kBucket, false)->value(-1, true), 0.7);
  EXPECT_EQ(receive_pdos(*bus.find(0x41)), (std::vector<std::uint8_t>{1, 2}));
}

TEST(ModuleFile, InputsAreFramesOfFour) {
  const BusDescription bus = module_machine().bus;
  ASSERT_EQ(bus.broadcasts.size(), 3U);
  EXPECT_EQ(bus.broadcasts[0].id, 0x2C1U);
  EXPECT_EQ(bus.broadcasts[1].fields.size(), 3U) << "nothing hangs on the seventh input";
  EXPECT_EQ(bus.broadcasts[1].bytes, 8);
  EXPECT_EQ(bus.broadcasts[2].id, 0x4C1U);
  EXPECT_EQ(bus.broadcasts[2].bytes, 6);
  const BroadcastField& head = bus.broadcasts[0].fields[0];
  EXPECT_NEAR(value_of(head.bits, 6553), 0, 1e-3);
  EXPECT_NEAR(value_of(head.bits, 32767), 400 * kBar, 1);
  const BroadcastField arm = *bus.broadcast(NodeRole::kEncoder, kArm).field;
  EXPECT_NEAR(value_of(arm.bits, 3276), -20 * kDegree, 1e-9);
  EXPECT_NEAR(value_of(arm.bits, 29490), -160 * kDegree, 1e-9);
  EXPECT_TRUE(bus.measures_angle(kArm));
}

TEST(ModuleFile, ABrokenWireIsKnownByItsRange) {
  const AnalogSensor current{AnalogSensor::Range::k4To20mA, 0, 160},
      voltage{AnalogSensor::Range::kHalfTo4AndAHalfV, 40, 0}, plain{AnalogSensor::Range::k0To10V, 0, 100};
  // 10 a milliampere: 3.6 and 21 mA.
  EXPECT_FALSE(current.is_broken(-3.9));
  EXPECT_TRUE(current.is_broken(-4.1));
  EXPECT_FALSE(current.is_broken(169.9));
  EXPECT_TRUE(current.is_broken(170.1));
  EXPECT_DOUBLE_EQ(current.broken(), -40);
  // 10 a volt, downwards: 0.25 and 4.75 V.
  EXPECT_FALSE(voltage.is_broken(42.4));
  EXPECT_TRUE(voltage.is_broken(42.6));
  EXPECT_FALSE(voltage.is_broken(-2.4));
  EXPECT_TRUE(voltage.is_broken(-2.6));
  EXPECT_DOUBLE_EQ(voltage.broken(), 45);
  EXPECT_DOUBLE_EQ(plain.broken(), 0);
  EXPECT_FALSE(plain.is_broken(0));
  EXPECT_TRUE(current.is_broken(std::numeric_limits<double>::quiet_NaN()));
}

TEST(ModuleFile, CheckSaysWhatIsNotTold) {
  std::string all;
  for (const std::string& note : machine_notes(module_machine())) all += note + "\n";
  EXPECT_TRUE(test::says(all, "slope is on a 0-10V input, where a broken wire reads as 0 V, as -0.873 rad"));
  EXPECT_FALSE(test::says(all, "boom_angle is on"));
  EXPECT_TRUE(test::says(all, "that the outputs of module take their error values"));
  EXPECT_FALSE(test::says(all, "own controller ends all motion"));
  EXPECT_FALSE(test::says(all, "e_stop_closed")) << "the enable node tells it";
}

TEST(ModuleFile, WhatCannotBeIsRefusedInOneLine) {
  test::expect_refused(
      {
          {"joint = \"arm\"", "joint = \"boom\"", "moves the joint as module_1 of 'module_rpdo2' does"},
          {"neutral = 6, extend = 9", "extend = 9", "'bus.node[1].outputs.1.neutral' is missing"},
          {"neutral = 6, extend", "neutral = 6.0005, extend", "cannot be said by these bits: nearest is 6.001"},
          {"scale = 0.001, neutral = 6, extend", "scale = 0.00030518509475997, neutral = 6, extend",
           "nearest is 5.99993896"},
          {"retract = 3 }", "retract = 8 }", "must be on neutral's other side than extend"},
          {"extend = 9", "extend = 6.05", "must be at least 100 steps of scale from neutral"},
          {"4 = { scale = 0.001, neutral = 6 }", "5 = { scale = 0.001, neutral = 6 }",
           "must say all outputs that the module has, from 1 on"},
          {"4 = { scale", "13 = { scale", "'bus.node[1].outputs.13' = a table: must be a channel from 1 to 12"},
          {"error_value_shift = 16\n", "", "error_value_shift"},
          {"error_value_shift = 16", "error_value_shift = 8", "must be 16 where object 0x6444"},
          {"\"boom_rod_pressure\"", "\"boom_head_pressure\"", "is taken by 'module'"},
          {"signal = \"slope\"", "signal = \"boom_length\"", "inputs.11.unit' = 'deg': must be one of"},
          {"\"slope\"", "\"boom_spool\"", "must be one of"},
          {"range = \"0-10V\"", "range = \"0-5V\"", "must be one of"},
          {"counts_low = 6553", "counts_low = -32768", "leaves no counts for a broken wire"},
          {"counts_high = 32767", "counts_high = 6553", "must not be counts_low"},
          {"counts_high = 32767", "counts_high = 8000", "makes a count 0.276"},
          {"high = 400", "high = 300", "must reach sensors.pressure_range_bar, 400"},
          {"high = 400", "high = 0", "must not be low"},
          {"id = 0x41\n", "id = 0x41\nrpdo2 = 0x240\n", "its frames' identifier 0x240 is taken by 'enable.rpdo'"},
          {"name = \"module\"\n", "name = \"module\"\nchannels = { 1 = \"machine_enable\" }\n", "channels"},
      },
      [](const auto& from, const auto& to) { (void)module_machine(test::kVoltageOutputs, from, to); });
}

TEST(ModuleFile, OutputsAreNoSpeeds) {
  constexpr const char* kSpeeds = R"([bus.node.outputs]
1 = { joint = "boom", unit = "rad/s", scale = 0.0001, neutral = 0, extend = 0.6, retract = -0.6 }
2 = { joint = "arm", unit = "rad/s", scale = 0.0001, neutral = 0, extend = -0.6, retract = 0.6 }
3 = { joint = "bucket", unit = "rad/s", scale = 0.0001, neutral = 0, extend = -0.6, retract = 0.6 }
)";
  const std::string line = test::refusal([&] { (void)module_machine(kSpeeds); });
  EXPECT_TRUE(test::says(line, "say voltages, currents or pressures, no speeds"));
}

TEST(ModuleFile, WhatARefusalCallsNearestIsTaken) {
  const BusDescription bus =
      module_machine(test::kVoltageOutputs, "scale = 0.001, neutral = 6, extend = 9, retract = 3",
                     "scale = 0.00030518509475997, neutral = 5.99993896, extend = 8.99990844, retract = 2.99996948")
          .bus;
  const CommandField& boom = bus.commands[0].fields[0];
  EXPECT_EQ(raw_of(boom.bits, boom.value(0, true)), 19660U);
  EXPECT_EQ(raw_of(boom.bits, boom.value(-1, true)), 9830U);
}

TEST(ModuleFile, AFieldSaysNothingByTheBitsForThatNorWithABrokenWire) {
  const BroadcastField plain{.bits = {.bits = 8, .scale = 0.5, .offset = -10}, .invalid_from = 0xFB};
  EXPECT_EQ(plain.value(0xFA), 0.5 * 0xFA - 10);
  EXPECT_EQ(plain.value(0xFB), std::nullopt);
  EXPECT_EQ(plain.value(0xFF), std::nullopt);
  EXPECT_EQ(plain.value(std::nullopt), std::nullopt);
  const BroadcastField counts{.bits = {.type = BitField::Type::kSigned, .bits = 16, .scale = 0.00625, .offset = -75},
                              .analog = AnalogSensor{AnalogSensor::Range::k4To20mA, -50, 50}};
  EXPECT_EQ(counts.value(12000), 0);
  EXPECT_TRUE(counts.value(3601).has_value());
  EXPECT_EQ(counts.value(3599), std::nullopt);
  EXPECT_TRUE(counts.value(20999).has_value());
  EXPECT_EQ(counts.value(21001), std::nullopt);
}

TEST(ModuleFile, ANameIsALetterAndLettersDigitsAndUnderscoresUpToItsLength) {
  for (const char* name : {"a", "Z9", "a_b_2"}) EXPECT_TRUE(is_plain_name(name, 5)) << name;
  for (const char* name : {"", "abcdef", "_a", "1a", "a-b", "a b", "\xC3\xA4"})
    EXPECT_FALSE(is_plain_name(name, 5)) << name;
}

TEST(ModuleFile, AKeyThatIsNoWholeNumberAsWrittenNamesNoChannel) {
  EXPECT_EQ(channel_number("0"), 0);
  EXPECT_EQ(channel_number("12"), 12);
  for (const char* key : {"", "01", "00", "+1", "1 ", "1a", "100"}) EXPECT_EQ(channel_number(key), std::nullopt) << key;
}

}  // namespace
}  // namespace knuckle
