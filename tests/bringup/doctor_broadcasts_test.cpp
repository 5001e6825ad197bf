// What the doctor says of frames that the machine should send by itself.
#include <gtest/gtest.h>

#include "app/bringup/doctor_bus.h"
#include "app/bringup/doctor_frames.h"
#include "tests/bringup/surveyed.h"
#include "tests/support/j1939_machine.h"
#include "tests/support/multiplexed_machine.h"
#include "tests/support/says.h"
#include "tests/support/two_buses.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::says;
BusDiagnosis broadcasts_looked_at(const MachineDescription& there, const MachineDescription& file) {
  return test::look(test::nominal_bus(there), file);
}

using knuckle::test::broadcast_machine;

TEST(DoctorBroadcasts, SaysOfEachMultiplexedFrameHowOftenItComes) {
  using knuckle::test::multiplexed_machine;
  const MachineDescription there = multiplexed_machine("period_ms = 10", "period_ms = 20");
  const BusDiagnosis sound = broadcasts_looked_at(there, there);
  EXPECT_TRUE(healthy(sound.findings)) << test::faults(sound);
  const std::string all = test::said(sound, Finding::Level::kOk);
  EXPECT_TRUE(says(all, "front_angle (0x18FF1021): comes every 20."));
  EXPECT_TRUE(says(all, "pressure_1 (0x18FF1021): comes every 10."));
  EXPECT_TRUE(says(all, "arm_angle -1.500 rad"));
  const std::string other = test::faults(broadcasts_looked_at(there, multiplexed_machine("value = 2", "value = 3")));
  EXPECT_TRUE(says(other, "pressure_1 (0x18FF1021): not received"));
}

TEST(DoctorBroadcasts, WhatDoesNotComeOrNotAsTheFileSaysIsAFault) {
  const MachineDescription there = broadcast_machine();
  const std::string other_id =
      test::faults(broadcasts_looked_at(there, broadcast_machine("id = 0x18FF1021", "id = 0x18FF1022")));
  EXPECT_TRUE(says(other_id, "front_angle (0x18FF1022): not received"));
  const std::string longer = test::faults(broadcasts_looked_at(there, broadcast_machine("bytes = 6", "bytes = 8")));
  EXPECT_TRUE(says(longer, "with 6 bytes; the file has 8"));
  const BusDiagnosis slow = broadcasts_looked_at(broadcast_machine("period_ms = 20", "period_ms = 24"),
                                                 broadcast_machine("period_ms = 20", "period_ms = 20"));
  EXPECT_TRUE(healthy(slow.findings)) << "within half of the age limit";
  EXPECT_FALSE(says(test::said(slow, Finding::Level::kNote), "frames 0x"));
}

TEST(DoctorBroadcasts, OfTwoBusesEachIsLookedAtAloneAndWhatIsSaidOfTheSecondNamesIt) {
  const std::string text = knuckle::test::two_buses_text();
  std::string other = text;
  other.replace(other.find("id = 0x18FF1021"), 15, "id = 0x18FF1022");
  const MachineDescription there = parse_machine(text, "m.toml"), file = parse_machine(other, "m.toml");
  const auto bus = test::nominal_bus(there);
  std::vector<BusAccess> access{sim::access_to(bus, 0), sim::access_to(bus, 1)};
  const BusDiagnosis all = together(diagnose_each(access, file, test::brief()), file.bus);
  EXPECT_EQ(all.nodes.size(), there.bus.nodes.size());
  EXPECT_TRUE(says(test::faults(all), "bus machine, front_angle (0x18FF1022): not received"));
  const std::string good = test::said(all, Finding::Level::kOk);
  EXPECT_TRUE(says(good, "bus machine, body ("));
  EXPECT_TRUE(says(good, "\nnode 0x10 boom_valve: as the machine file requires"));
}

TEST(DoctorBroadcasts, SaysWhatEachValueIsAndHowOftenItComes) {
  const MachineDescription machine = knuckle::test::commanded_j1939_machine();
  const BusDiagnosis diagnosis = broadcasts_looked_at(machine, machine);
  const std::string all = test::said(diagnosis, Finding::Level::kOk);
  for (const char* said :
       {"front_angle (0x18FF1021): comes every 10.", "with 8 bytes: arm_angle -1.500 rad, boom_angle 0.300 rad",
        " bar, ", " bytes: slope ", "e_stop_closed yes, pilot_on no", "engine (PGN 0xF004 of 0x00): comes every 20.",
        ": engine_running yes, engine_speed 1800.0 rpm\n"})
    EXPECT_TRUE(says(all, said));
  const std::string notes = test::said(diagnosis, Finding::Level::kNote);
  EXPECT_TRUE(says(notes, "hours (PGN 0xFEE5 of 0x00): comes only when it is asked for"));
  EXPECT_TRUE(healthy(diagnosis.findings)) << test::faults(diagnosis);
}

/// A survey in which these were heard, 100 each in a second.
Findings own_frames_heard(const MachineDescription& machine, const std::vector<CanFrame>& frames) {
  BusSurvey survey;
  survey.listened_s = 1;
  for (const CanFrame& frame : frames) survey.heard[frame.id] = {.count = 100, .newest = frame};
  return own_frame_findings(survey, machine.bus);
}

std::string said_of(const Findings& findings, const std::string& about) {
  std::string all;
  for (const Finding& one : findings)
    if (one.about.find(about) != std::string::npos) all += std::string(name(one.level)) + " " + one.text + "\n";
  return all;
}

TEST(DoctorBroadcasts, ASecondSenderOfAGroupAndWhoHasKnucklesAddressAreTold) {
  const MachineDescription machine = knuckle::test::j1939_machine("id = 0x18FF1021", "pgn = 0xFF10");
  const auto frame = [](std::uint32_t id) { return CanFrame{.id = id | kExtendedId, .size = 8, .data = {0xFF}}; };
  const Findings findings = own_frames_heard(machine, {frame(0x18FF1021), frame(0x18FF1022), frame(0x0CF00400),
                                                       frame(0x0CF00417), frame(0x18FEEE03), frame(0x18FEF1F9)});
  EXPECT_EQ(
      said_of(findings, "front_angle (PGN 0xFF10)").rfind("FAULT is also sent by 0x22: take that device off, or", 0),
      0U)
      << said_of(findings, "front_angle");
  EXPECT_EQ(said_of(findings, "engine (").rfind("note is also sent by 0x17: take that device off\n", 0), 0U);
  EXPECT_EQ(said_of(findings, "coolant (PGN 0xFEEE)"),
            "ok comes every 10.0 ms, with 8 bytes: coolant_temperature not available\n");
  EXPECT_EQ(said_of(findings, "hydraulics").rfind("note not received", 0), 0U);
  EXPECT_EQ(said_of(findings, "J1939 address 0xF9").rfind("note is used: 0x18FEF1F9 comes from it", 0), 0U);
}

TEST(DoctorBroadcasts, AFrameOf29BitsThatTheFileDoesNotHaveIsNoted) {
  const MachineDescription there = broadcast_machine();
  const std::string notes = test::said(
      broadcasts_looked_at(there, broadcast_machine("id = 0x18FF1021", "id = 0x18FF1022")), Finding::Level::kNote);
  EXPECT_TRUE(says(notes, "frames 0x18FF1021: "));
  EXPECT_FALSE(says(notes, "possibly an additional PDO"));
}

TEST(DoctorBroadcasts, SaysThatItDoesNotPutPacketsTogether) {
  const MachineDescription machine = parse_machine(knuckle::test::packets_text(), "m.toml");
  const BusDiagnosis diagnosis = broadcasts_looked_at(machine, machine);
  EXPECT_TRUE(healthy(diagnosis.findings)) << test::faults(diagnosis);
  const std::string notes = test::said(diagnosis, Finding::Level::kNote);
  EXPECT_TRUE(says(notes, "coolant (PGN 0x1FF60): comes in 3 packets, which this check does not put together"));
  EXPECT_FALSE(says(notes, "frames 0x1CE"));
}

}  // namespace
}  // namespace knuckle::bringup
