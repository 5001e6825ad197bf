// The commissioning of machines whose sensors and commands are frames of their own bus.
#include <gtest/gtest.h>

#include "core/error.h"
#include "machine/room.h"
#include "tests/bringup/commissioned.h"
#include "tests/support/command_machine.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::command_text;
using knuckle::test::kPilotCommands;
using knuckle::test::kRateCommands;
using test::commission;
using test::machine_of;
using test::Outcome;
using test::Script;
using test::simulated_bus;
using test::with;

Script up_to_motion(const char* zero = "correct") {
  return {"ready", "send", "pressed", "released", "0", "tape", zero, "tape", zero, "tape", zero, "pilot", "move"};
}
Script all(bool dead_bands) {
  Script script = up_to_motion();
  for (int j = 0; j < kJoints; ++j) script.insert(script.end(), {"go", "longer", "go", "shorter"});
  script.emplace_back("guards");
  for (int j = 0; j < kJoints; ++j) script.insert(script.end(), {"go", "go", "go"});
  if (dead_bands) script.insert(script.end(), {"go", "go", "go"});
  script.emplace_back("finish");
  return script;
}

void check_zeros(const Outcome& outcome, double boom_shift_rad) {
  for (std::size_t j = 0; j < kJoints; ++j) EXPECT_TRUE(outcome.result.axes[j].preset) << j;
  // A tape is read to a millimetre, and pins are some beside the drawing.
  EXPECT_NEAR(outcome.result.axes[kBoom].zero_shift.value_or(0), boom_shift_rad, 0.03);
  EXPECT_NEAR(outcome.result.axes[kArm].zero_shift.value_or(1), 0, 0.03);
}

TEST(CommissionFrames, ZerosSignsAndWhatEndsMotionAreFoundOfAMachineLedBySpeeds) {
  const std::string true_text = command_text(), text = with(true_text, "zero_rad = 0.12", "zero_rad = 0.42");
  const MachineDescription file = machine_of(text);
  check_layout(text, file);
  const Outcome outcome = commission(machine_of(true_text), file, all(false));
  ASSERT_EQ(outcome.ended, "") << outcome.told;
  EXPECT_TRUE(healthy(outcome.result.findings)) << outcome.told;
  check_zeros(outcome, -0.3);
  EXPECT_NE(outcome.told.find("boom, when command frames end: its cylinder stands after"), std::string::npos);
  EXPECT_NE(outcome.told.find("dead bands: not measured"), std::string::npos);

  const std::string found = commissioned_text(text, file, outcome.result, {"can0", "2026-03-01", "x"});
  const MachineDescription back = machine_of(found);
  const double zero = back.bus.broadcast(NodeRole::kEncoder, kBoom).field->bits.offset;
  EXPECT_NEAR(zero, file.bus.broadcast(NodeRole::kEncoder, kBoom).field->bits.offset - 0.3, 0.03);
  EXPECT_EQ(back.bus.commands_guard, (GuardProof{true, 0, "2026-03-01"}));
  for (const std::string& note : machine_notes(back)) EXPECT_EQ(note.find("ends all motion"), std::string::npos);
  const auto changed = [&](const std::string& from, const std::string& to) {
    return machine_of(with(found, from, to)).bus.commands_guard.changed;
  };
  EXPECT_EQ(changed("valve_watchdog_ms = 50 ", "valve_watchdog_ms = 60 "), GuardProof::Changed::kTimes);
  EXPECT_EQ(changed("id = 0x18FF0105", "id = 0x18FF0205"), GuardProof::Changed::kChannels);
}

TEST(CommissionFrames, DeadBandsAreFoundOfPilotValves) {
  const std::string text = command_text(kPilotCommands);
  const Outcome outcome = commission(machine_of(text), machine_of(text), all(true));
  ASSERT_EQ(outcome.ended, "") << outcome.told;
  EXPECT_TRUE(healthy(outcome.result.findings)) << outcome.told;
  check_zeros(outcome, 0);
  const AxisResult& boom = outcome.result.axes[kBoom];
  ASSERT_TRUE(boom.dead_band_extend && boom.dead_band_retract);
  EXPECT_NEAR(*boom.dead_band_extend, 0.11, 0.04);
}

TEST(CommissionFrames, AMachineThatGoesOnWithoutCommandsIsNotTaken) {
  const std::string text = command_text();
  MachineDescription deaf = machine_of(text);
  deaf.bus.valve_watchdog_s = 0.5;
  const Outcome outcome = commission(deaf, machine_of(text), all(false));
  EXPECT_NE(outcome.ended.find("boom, when command frames end: its cylinder stands after"), std::string::npos)
      << outcome.ended;
  EXPECT_NE(outcome.ended.find("which is late: valve_watchdog_ms = 50"), std::string::npos) << outcome.ended;
}

TEST(CommissionFrames, AMachineThatNeverStopsIsFoundAndLedNoFurtherThanALittle) {
  const MachineDescription machine = machine_of(command_text());
  MachineDescription deaf = machine;
  deaf.bus.valve_watchdog_s = 10;
  const auto bus = simulated_bus(deaf, 7);
  const double before_m = bus->plant().cylinder_m[kBoom];
  BusAccess access = sim::access_to(bus);
  JogBench bench(machine, access, [] { return false; });
  bench.start();
  const JogRun run = bench.run({.joint = kBoom,
                                .peak = slave::kJogTable.command,
                                .rise_1ps = 0.5,
                                .travel_m = 5e-3,
                                .longest_s = 10,
                                .then_silence = true});
  EXPECT_EQ(judge_silence(run, machine.bus).finding.level, Finding::Level::kFault);
  EXPECT_LT(bus->plant().cylinder_m[kBoom] - before_m, 0.025) << "four times 5 mm, and what it takes to stop";
}

TEST(CommissionFrames, BesideAnEnableNodeItsGuardIsProvedToo) {
  std::string text = command_text(kRateCommands, "");
  text.insert(text.find("[[bus.command]]"),
              "[[bus.node]]\nname = \"enable\"\nprofile = \"cia401\"\nid = 0x40\ndevice_type = 0x0191\n"
              "vendor = 0x4B4E\nproduct = 0x0401\nchannels = { 1 = \"machine_enable\" }\n");
  Script script = all(false);
  script[1] = "configure";
  const Outcome outcome = commission(machine_of(text), machine_of(text), script);
  ASSERT_EQ(outcome.ended, "") << outcome.told;
  EXPECT_TRUE(healthy(outcome.result.findings)) << outcome.told;
  ASSERT_EQ(outcome.result.guards.size(), 2U);
  EXPECT_EQ(outcome.result.guards[1].node, "enable");
  EXPECT_TRUE(outcome.result.guards[1].proved) << outcome.told;
}

TEST(CommissionFrames, WhatNoFrameTellsIsSaidAndTheRestIsDone) {
  const std::string text = command_text(kRateCommands, "");
  Script script = all(false);
  script.erase(script.begin() + 2, script.begin() + 4);  // nobody asks for the E-stop
  const Outcome outcome = commission(machine_of(text), machine_of(text), script);
  ASSERT_EQ(outcome.ended, "") << outcome.told;
  EXPECT_NE(outcome.told.find("E-stop: no frame tells of it"), std::string::npos) << outcome.told;
}

TEST(CommissionFrames, AnAngleThatCountsTheOtherWayIsFoundByASmallMotion) {
  const std::string text = command_text();
  const std::string wrong = with(text, "unit = \"rad\", sign = -1", "unit = \"rad\"");
  const Outcome outcome = commission(machine_of(text), machine_of(wrong), all(false));
  EXPECT_NE(outcome.ended.find("boom: its encoder counts in the wrong direction: change 'sign' of "
                               "boom_angle in the machine file"),
            std::string::npos)
      << outcome.ended;
  EXPECT_LT(outcome.moved_m, 0.03);
}

TEST(CommissionFrames, NothingMovesByAnAngleThatIsNoneOfTheJoints) {
  const std::string text = command_text();
  const std::string wrong = with(text, "zero_rad = 0.12", "zero_rad = 2.5");
  const Outcome outcome = commission(machine_of(text), machine_of(wrong), up_to_motion("keep"));
  EXPECT_NE(outcome.ended.find("its zero must be corrected"), std::string::npos) << outcome.ended;
  EXPECT_LT(outcome.moved_m, 1e-3);
}

TEST(CommissionFrames, WithValveNodesAnglesOfTheMachineAreCorrectedToo) {
  const std::string true_text = knuckle::test::broadcast_text();
  const std::string text = with(true_text, "zero_rad = 0.12", "zero_rad = 0.42");
  Script script = up_to_motion();
  script[1] = "configure";
  script.insert(script.end() - 1, "guards");
  for (int j = 0; j < kJoints; ++j) script.insert(script.end(), {"go", "longer", "go", "shorter"});
  for (int j = 0; j < kJoints; ++j) script.insert(script.end(), {"go", "go", "go"});
  script.insert(script.end(), {"go", "go", "go", "finish"});
  const Outcome outcome = commission(machine_of(true_text), machine_of(text), script);
  ASSERT_EQ(outcome.ended, "") << outcome.told;
  EXPECT_TRUE(healthy(outcome.result.findings)) << outcome.told;
  check_zeros(outcome, -0.3);
}

TEST(CommissionFrames, ASignalThatIsNotOnOneLineIsRefusedBeforeAnythingMoves) {
  const std::string text = with(command_text(),
                                "boom_angle = { start = 0, bits = 16, scale = 0.0004, offset = -10, "
                                "unit = \"rad\", sign = -1, zero_rad = 0.12 }",
                                "boom_angle.start = 0\nboom_angle.bits = 16\nboom_angle.scale = 0.0004\n"
                                "boom_angle.offset = -10\nboom_angle.unit = \"rad\"\nboom_angle.sign = -1");
  const MachineDescription machine = machine_of(text);
  EXPECT_THROW(check_layout(text, machine), InputError);
}

/// Readings are no sensors that a motion is judged by.
TEST(CommissionFrames, ReadingsOfTheMachineChangeNothing) {
  const std::string text = command_text(
      kRateCommands, std::string(knuckle::test::kStateBroadcast) +
                         "[[bus.broadcast]]\nname = \"engine\"\nid = 0x18FF5021\nbytes = 8\nperiod_ms = 20\n"
                         "[bus.broadcast.signals]\nengine_speed = { start = 0, bits = 16, scale = 0.125, "
                         "unit = \"rpm\" }\noil_temperature = { start = 16, bits = 8, scale = 1, offset = -40, unit = "
                         "\"degC\" }\nengine_hours = { start = 32, bits = 32, scale = 0.05, unit = \"h\" }\n");
  const Outcome outcome = commission(machine_of(text), machine_of(text), all(false));
  ASSERT_EQ(outcome.ended, "") << outcome.told;
  check_zeros(outcome, 0);
}

}  // namespace
}  // namespace knuckle::bringup
