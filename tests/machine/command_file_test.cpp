// [[bus.command]]: frames that tell the machine's own controller what to do, as the file has them.
#include <gtest/gtest.h>

#include <numbers>

#include "machine/bus_budget.h"
#include "machine/room.h"
#include "machine/set_points.h"
#include "tests/support/command_machine.h"
#include "tests/support/refused_changes.h"

namespace knuckle {
namespace {

using test::command_machine;

TEST(CommandFile, SaysWhatMovesAJointAndWhatRests) {
  const BusDescription bus = command_machine().bus;
  EXPECT_TRUE(bus.nodes.empty());
  EXPECT_EQ(bus.command_kind, CommandKind::kJointRate);
  ASSERT_EQ(bus.commands.size(), 2U);
  EXPECT_EQ(bus.commands[0].id, 0x18FF0105U | kExtendedId);
  EXPECT_EQ(bus.commands[1].id, 0x1A6U);
  EXPECT_EQ(bus.set_point_id(kBucket), bus.commands[0].id);
  const CommandField& arm = *bus.command(kArm, true);
  EXPECT_EQ(arm.name, "arm_rate");
  EXPECT_EQ(raw_of(arm.bits, arm.value(1, true)), 30200U) << "(-0.9 + 16) / 0.0005";
  EXPECT_EQ(raw_of(arm.bits, arm.value(-0.5, false)), 32900U);
  EXPECT_EQ(raw_of(arm.bits, arm.value(0, true)), 32000U);
  EXPECT_NEAR(bus.full_rate_radps(kBucket, true), 70 * std::numbers::pi / 180, 1e-12);
  const CommandField& switched = bus.commands[1].fields[0];
  EXPECT_EQ(switched.name, "front_by_bus");
  EXPECT_EQ(switched.value(1, false), 1);
  EXPECT_EQ(switched.value(1, true), 2);
  EXPECT_EQ(bus.commands[1].fields[1].value(0, true), 3) << "not used: its neutral, always";
}

TEST(CommandFile, TheUnitIsTheKindOfCommand) {
  const BusDescription pilot = command_machine(test::kPilotCommands).bus;
  EXPECT_EQ(pilot.command_kind, CommandKind::kPilotPressure);
  EXPECT_FALSE(pilot.commands[0].always);
  EXPECT_EQ(pilot.command(kBoom, true)->name, "boom_up");
  EXPECT_EQ(pilot.command(kBoom, false)->name, "boom_down");
  EXPECT_NEAR(pilot.command(kBoom, true)->value(0.5, true), 20e5, 1e-6);
  EXPECT_EQ(pilot.command(kBoom, true)->value(-0.5, true), 0) << "the other way is the other valve's";
  EXPECT_EQ(pilot.full_rate_radps(kBoom, true), 0) << "no speed";
  std::string current = test::kPilotCommands;
  for (std::size_t at = 0; (at = current.find("\"bar\"", at)) != std::string::npos;) current.replace(at, 5, "\"mA\"");
  EXPECT_EQ(command_machine(current).bus.command_kind, CommandKind::kCurrent);
}

TEST(CommandFile, WhoReadsTheWireFindsTheCommandsAgain) {
  const BusDescription bus = command_machine().bus, pilot = command_machine(test::kPilotCommands).bus;
  const CanFrame rates{bus.commands[0].id, 8, {0x00, 0x7D, 0xF8, 0x75, 0xFE, 0xA2, 0x00, 0x7D}};
  EXPECT_EQ(set_point_in(rates, kBoom, bus), 0);
  EXPECT_NEAR(set_point_in(rates, kArm, bus).value(), 1, 1e-9) << "30200";
  EXPECT_NEAR(set_point_in(rates, kBucket, bus).value(), 0.5, 1e-9) << "-350";
  const CanFrame pressures{pilot.commands[0].id, 6, {0, 100, 50, 0, 0, 0}};
  EXPECT_NEAR(set_point_in(pressures, kBoom, pilot).value(), -0.5, 1e-9);
  EXPECT_NEAR(set_point_in(pressures, kArm, pilot).value(), 0.25, 1e-9);
  EXPECT_EQ(set_point_in(pressures, kBucket, pilot), 0);
  EXPECT_EQ(set_point_in(pressures, kBoom, bus), std::nullopt) << "another frame";
  const CanFrame both{pilot.commands[0].id, 6, {100, 100, 0, 0, 0, 0}};
  EXPECT_NE(set_point_in(both, kBoom, pilot), 0) << "both valves at once are not neutral";
  BusDescription floats = bus;
  for (CommandField& field : floats.commands[0].fields)
    if (field.joint == kBoom) field.bits = {.type = BitField::Type::kFloat, .start_bit = 0, .bits = 32};
  CanFrame slow{floats.commands[0].id, 8, {}};
  write_value(floats.commands[0].fields[1].bits, 0.01, slow);
  EXPECT_NE(set_point_in(slow, kBoom, floats).value(), 0) << "0.01 rad/s";
}

TEST(CommandFile, TheBusBudgetCountsCommandsAndNoSync) {
  MachineDescription machine = command_machine();
  const double all = worst_bus_load(machine.bus);
  machine.bus.broadcasts.clear();
  // At worst 160 bits with 29 bits of identifier, 135 with 11.
  EXPECT_NEAR(worst_bus_load(machine.bus), (100 * 160 + 50 * 135) / 500e3, 1e-9);
  EXPECT_GT(all, worst_bus_load(machine.bus));
}

TEST(CommandFile, WhatTheMachineDoesNotTellIsSaid) {
  const auto notes_of = [](const MachineDescription& machine) {
    std::string all;
    for (const std::string& note : machine_notes(machine)) all += note + '\n';
    return all;
  };
  const std::string told = notes_of(command_machine());
  EXPECT_FALSE(test::says(told, "e_stop_closed"));
  EXPECT_FALSE(test::says(told, "pilot_on"));
  EXPECT_TRUE(test::says(told, "nobody tells where the spools are"));
  EXPECT_TRUE(test::says(told, "ends all motion 50 ms after the last command frame is not proved"));
  using Changed = GuardProof::Changed;
  const auto with_proof = [&](bool proved, Changed changed) {
    MachineDescription machine = command_machine();
    machine.bus.commands_guard = {proved, 0, "2026-03-01", changed};
    return notes_of(machine);
  };
  EXPECT_FALSE(test::says(with_proof(true, Changed::kNothing), "ends all motion"));
  EXPECT_TRUE(test::says(with_proof(true, Changed::kTimes), "was proved on 2026-03-01, with other frames"));
  EXPECT_TRUE(test::says(with_proof(false, Changed::kNothing), "was tried on 2026-03-01 and not proved"));
  const std::string silent = notes_of(parse_machine(test::command_text(test::kRateCommands, ""), "m.toml"));
  EXPECT_TRUE(test::says(silent, "no frame has e_stop_closed: "));
  EXPECT_TRUE(test::says(silent, "no frame has pilot_on: "));
}

TEST(CommandFile, WhatCannotBeIsRefusedInOneLine) {
  test::expect_refused(
      {
          {"offset = -16, neutral = 0 }", "offset = -16 }", "slew_rate.neutral' is missing"},
          {"joint = \"boom\", neutral = 0", "joint = \"boom\"", "boom_rate.neutral' is missing"},
          {"offset = -16, neutral = 0 }", "offset = -15.9998, neutral = 0 }",
           "slew_rate.neutral' = 0: cannot be said by these bits: nearest is 0.0002"},
          {"extend = 0.6", "extend = 17", "boom_rate.extend' = 17: cannot be said by these bits: nearest is 16.7675"},
          {"extend = 0.6, ", "", "of a speed it must have extend and retract"},
          {"retract = -0.6", "retract = 0.5", "must be on neutral's other side than extend"},
          {"extend = 0.6", "extend = 0", "extend' = 0: must be at least 100 steps of scale from neutral"},
          {"joint = \"arm\"", "joint = \"boom\"", "moves the joint as arm_rate of 'front_rate' does"},
          {"joint = \"arm\"", "joint = \"stick\"", "must be one of \"boom\", \"arm\", \"bucket\""},
          {"unit = \"rad/s\", joint = \"boom\"", "unit = \"bar\", joint = \"boom\"",
           "is another kind of command than that of another joint's field"},
          {"unit = \"rad/s\", joint = \"boom\"", "unit = \"m/s\", joint = \"boom\"", "must be one of"},
          {"start = 48, bits = 16, scale", "start = 40, bits = 16, scale", "has bits of"},
          {"period_ms = 10", "period_ms = 30", "must be at most 25, half of bus.valve_watchdog_ms"},
          {"period_ms = 10", "period_ms = 2.5", "must be at least 5, the loop's period"},
          {"send = \"always\"", "send = \"engaged\"", "must be one of \"always\", \"while_led\""},
          {"led = 2", "led = 16", "led' = 16: cannot be said by these bits: nearest is 15"},
          {"modulus = 15", "modulus = 17", "must be a whole number within [2, 16]"},
          {"bits = 8, data_id", "bits = 8, bytes = [7], data_id", "it cannot cover itself"},
          {"id = 0x1A6", "id = 0x1A5", "is taken by 'body'"},
          {"id = 0x1A6", "id = 0x610", "has 0x610, the identifier of SDO requests"},
          {"id = 0x1A6", "id = 0x7E5", "has 0x7E5, the identifier of LSS"},
          {"scale = 0.1, unit = \"deg/s\"", "scale = 1, unit = \"deg/s\"",
           "must be at least 100 steps of scale from neutral"},
          {"horn = {", "\"\" = {", "its name must be a letter"},
          {"name = \"setting\"", "name = \"body\"", "is the name of another frame"},
          {"horn = {", "2horn = {", "its name must be a letter"},
          {"horn = { start", "horn = { value = 3, start", "value"},
      },
      [](const auto& from, const auto& to) { (void)command_machine(test::kRateCommands, from, to); });
}

constexpr const char* kBoomDown =
    "boom_down = { start = 8, bits = 8, scale = 0.2, unit = \"bar\", joint = \"boom\", neutral = 0, retract = 40 }\n";

TEST(CommandFile, AJointHasBothWays) {
  const std::string half = test::refusal([] { (void)command_machine(test::kPilotCommands, kBoomDown, ""); });
  EXPECT_TRUE(test::says(half, "no field retracts the boom: one must have joint = \"boom\" with retract"));
}

TEST(CommandFile, TheTwoWaysOfAJointAreInOneFrame) {
  const std::string commands =
      test::replaced(test::kPilotCommands, kBoomDown, "") +
      "[[bus.command]]\nname = \"pilot_2\"\nid = 0x18FF0405\nbytes = 2\nperiod_ms = 20\nsend = "
      "\"while_led\"\n[bus.command.fields]\n" +
      kBoomDown;
  const std::string line = test::refusal([&] { (void)command_machine(commands); });
  EXPECT_TRUE(test::says(line, "moves the boom as boom_up of 'pilot_1' does: a joint's two ways must be in one frame"));
}

TEST(CommandFile, WhatTheEnableNodeTellsIsToldByNoFrame) {
  const std::string text = test::broadcast_text(std::string(test::kBroadcasts) + test::kStateBroadcast);
  const std::string line = test::machine_refusal(text);
  EXPECT_TRUE(test::says(line, "do not go with an enable node, which tells both"));
}

TEST(CommandFile, StandsBesideNoNodeThatIsToldWhatToDo) {
  const std::string text = test::broadcast_text(std::string(test::kRateCommands) + test::kBroadcasts);
  const std::string line = test::machine_refusal(text);
  EXPECT_TRUE(
      test::says(line, "stands beside node 'boom_valve': valves are nodes, or frames and outputs tell all of them"));
}

}  // namespace
}  // namespace knuckle
