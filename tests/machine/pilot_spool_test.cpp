// Pilot pressures of a machine that is led by frames: in its file, and where a spool is by them.
#include "machine/pilot_spool.h"

#include <gtest/gtest.h>

#include <string>

#include "core/units.h"
#include "machine/room.h"
#include "tests/support/broadcast_machine.h"
#include "tests/support/command_machine.h"
#include "tests/support/module_machine.h"
#include "tests/support/refused_changes.h"

namespace knuckle {
namespace {

MachineDescription piloted(const std::string& from = "", const std::string& to = "") {
  const std::string pilots = test::replaced(test::kPilotPressures, from, to);
  return parse_machine(test::command_text(test::kPilotCommands, std::string(test::kStateBroadcast) + pilots), "m.toml");
}

std::string notes_of(const MachineDescription& machine) {
  std::string all;
  for (const std::string& note : machine_notes(machine)) all += note + '\n';
  return all;
}

TEST(PilotSpool, IsAtItsDeadBandWhereItBeginsToOpen) {
  const MachineDescription machine = piloted();
  const PilotSpool spool(machine, kArm);
  const double band = machine.cylinders[kArm].valve.dead_band_extend;
  EXPECT_EQ(spool.position(0, 0), 0);
  EXPECT_EQ(spool.opening(4.3e5, 0), 0);
  EXPECT_NEAR(spool.position(2.2e5, 0), band / 2, 1e-9);
  EXPECT_NEAR(spool.position(4.4e5, 0), band, 1e-9);
  EXPECT_NEAR(spool.opening(22.2e5, 0), 0.5, 1e-9);
  EXPECT_NEAR(spool.position(22.2e5, 0), band + 0.5 * (1 - band), 1e-9);
  EXPECT_EQ(spool.opening(50e5, 0), 1);
  EXPECT_EQ(spool.position(0, 50e5), -1);
  EXPECT_NEAR(spool.opening(0, 22.2e5), -0.5, 1e-9);
}

TEST(PilotSpool, GoesByTheDifferenceOfItsTwoPressures) {
  const MachineDescription machine = piloted();
  const PilotSpool spool(machine, kBoom);
  EXPECT_EQ(spool.opening(40e5, 40e5), 0) << "neither way";
  EXPECT_NEAR(spool.opening(25.2e5, 3e5), 0.5, 1e-9) << "3 bar are in both lines";
}

TEST(PilotPressures, AreSaidByTheMachineFile) {
  const BusDescription bus = piloted().bus;
  const auto [frame, field] = bus.broadcast(NodeRole::kPilot, 2 * kBucket + 1);
  ASSERT_NE(field, nullptr);
  EXPECT_EQ(frame->name, "pilot_pressure");
  EXPECT_NEAR(field->shut_Pa, 4.4e5, 1e-6);
  EXPECT_NEAR(field->full_Pa, 40e5, 1e-6);
  EXPECT_NEAR(value_of(field->bits, 100), 20e5, 1e-6);
  EXPECT_TRUE(tells_pilots(bus));
  EXPECT_FALSE(tells_pilots(test::command_machine().bus, kBoom));
}

TEST(PilotPressures, OfSomeJointsLeaveTheOthersUntold) {
  EXPECT_FALSE(test::says(notes_of(piloted()), "nobody tells where"));
  std::string pilots = test::kPilotPressures;
  pilots.erase(pilots.find("bucket_extend_pilot"));
  const MachineDescription two =
      parse_machine(test::command_text(test::kRateCommands, test::kStateBroadcast + pilots), "m.toml");
  EXPECT_TRUE(tells_pilots(two.bus, kArm));
  EXPECT_TRUE(test::says(notes_of(two), "nobody tells where the spool is of bucket: a valve that does not follow"));
}

TEST(PilotPressures, HangOnAModuleAsWell) {
  const std::string pilots =
      "7 = { signal = \"arm_extend_pilot\", range = \"0.5-4.5V\", counts_low = 3276, counts_high = 29490, low = 0, "
      "high = 50, unit = \"bar\", shut = 6, full = 24 }\n"
      "12 = { signal = \"arm_retract_pilot\", range = \"0-10V\", counts_low = 0, counts_high = 32767, low = 0, "
      "high = 2.4, unit = \"MPa\", shut = 0.6, full = 2.4 }\n";
  const MachineDescription machine =
      parse_machine(test::module_text(test::kVoltageOutputs, test::kInputs + pilots), "m.toml");
  EXPECT_TRUE(tells_pilots(machine.bus, kArm));
  EXPECT_NEAR(PilotSpool(machine, kArm).opening(0, 15e5), -0.5, 1e-6);
  const auto refused = [&](const std::string& from, const std::string& to) {
    return test::machine_refusal(
        test::module_text(test::kVoltageOutputs, test::kInputs + test::replaced(pilots, from, to)));
  };
  std::string line = refused("low = 0, high = 2.4", "low = 0, high = 2.3");
  EXPECT_TRUE(test::says(line, "reaches 2.3 MPa: must reach full, 2.4"));
  line = refused("counts_high = 29490", "counts_high = 3300");
  EXPECT_TRUE(test::says(line, "counts_high' = 3300: makes a step 2.08333333 bar: must be at most 0.9"));
}

TEST(PilotPressures, ThatCannotBeAreRefusedInOneLine) {
  const char* const boom = "unit = \"MPa\", shut = 0.44, full = 4";
  test::expect_refused(
      {{boom, "unit = \"MPa\", full = 4", "boom_extend_pilot.shut' is missing"},
       {boom, "unit = \"MPa\", shut = 0.44", "boom_extend_pilot.full' is missing"},
       {boom, "unit = \"MPa\", shut = -0.1, full = 4", "boom_extend_pilot.shut' = -0.1: must be"},
       {boom, "unit = \"MPa\", shut = 4, full = 4", "boom_extend_pilot.full' = 4: must be above shut"},
       {boom, "unit = \"mA\", shut = 0.44, full = 4", "boom_extend_pilot.unit' = 'mA': must be one of"},
       {boom, "unit = \"MPa\", shut = 0.44, full = 0.8", "makes a step 0.02 MPa: must be at most 0.018"},
       {boom, "unit = \"MPa\", shut = 0.44, full = 5.2", "reaches 5.1 MPa: must reach full, 5.2"},
       {boom, "unit = \"MPa\", shut = 0.44, full = 4, invalid_from = 200", "reaches 3.98 MPa: must reach full, 4"},
       {"period_ms = 10", "period_ms = 26", "must be at most 25, half of bus.sensor_age_limit_ms"},
       {"arm_retract_pilot = { start = 24, bits = 8, scale = 0.02, unit = \"MPa\", shut = 0.44, full = 4 }\n", "",
        "has arm_extend_pilot without arm_retract_pilot: of a joint there must be both or none"}},
      piloted);
}

TEST(PilotPressures, DoNotGoWithValveNodes) {
  const std::string text = test::broadcast_text(std::string(test::kBroadcasts) + '\n' + test::kPilotPressures);
  EXPECT_TRUE(
      test::says(test::machine_refusal(text),
                 "goes with [[bus.command]] tables or a module's outputs: valve nodes tell where their spools are"));
}

}  // namespace
}  // namespace knuckle
