// What the doctor says of frames that the machine should send by itself.
#include <gtest/gtest.h>

#include "app/bringup/doctor_bus.h"
#include "tests/bringup/surveyed.h"
#include "tests/support/broadcast_machine.h"

namespace knuckle::bringup {
namespace {

BusDiagnosis broadcasts_looked_at(const MachineDescription& there, const MachineDescription& file) {
  const auto bus = std::make_shared<sim::MachineOnBus>(sim::nominal_truth(there), sim::WorldDescription{},
                                                       JointVector(0.3, -1.5, -0.8), 1);
  BusAccess access = sim::access_to(bus);
  return diagnose(survey_bus(access, file.bus.bit_rate, doctor_objects(file), test::brief()), &file);
}

using knuckle::test::broadcast_machine;

TEST(DoctorBroadcasts, SaysHowOftenEachComes) {
  const MachineDescription machine = broadcast_machine();
  const BusDiagnosis diagnosis = broadcasts_looked_at(machine, machine);
  EXPECT_TRUE(healthy(diagnosis.findings)) << test::faults(diagnosis);
  const std::string all = test::said(diagnosis, Finding::Level::kOk);
  EXPECT_NE(all.find("front_angle (0x18FF1021): comes every 10."), std::string::npos) << all;
  EXPECT_NE(all.find("body (0x1A5): comes every 20."), std::string::npos) << all;
  EXPECT_EQ(test::said(diagnosis, Finding::Level::kNote).find("frames 0x"), std::string::npos);
}

TEST(DoctorBroadcasts, WhatDoesNotComeOrNotAsTheFileSaysIsAFault) {
  const MachineDescription there = broadcast_machine();
  const std::string other_id =
      test::faults(broadcasts_looked_at(there, broadcast_machine("id = 0x18FF1021", "id = 0x18FF1022")));
  EXPECT_NE(other_id.find("front_angle (0x18FF1022): not received"), std::string::npos) << other_id;
  const std::string longer = test::faults(broadcasts_looked_at(there, broadcast_machine("bytes = 6", "bytes = 8")));
  EXPECT_NE(longer.find("with 6 bytes; the file has 8"), std::string::npos) << longer;
  const BusDiagnosis slow = broadcasts_looked_at(broadcast_machine("period_ms = 20", "period_ms = 24"),
                                                 broadcast_machine("period_ms = 20", "period_ms = 20"));
  EXPECT_TRUE(healthy(slow.findings)) << "within half of the age limit";
}

TEST(DoctorBroadcasts, AFrameOf29BitsThatTheFileDoesNotHaveIsNoted) {
  const MachineDescription there = broadcast_machine();
  const std::string notes = test::said(
      broadcasts_looked_at(there, broadcast_machine("id = 0x18FF1021", "id = 0x18FF1022")), Finding::Level::kNote);
  EXPECT_NE(notes.find("frames 0x18FF1021: "), std::string::npos) << notes;
  EXPECT_EQ(notes.find("possibly an additional PDO"), std::string::npos) << notes;
}

}  // namespace
}  // namespace knuckle::bringup
