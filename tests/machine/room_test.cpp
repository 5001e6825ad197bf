// What limits leave of the working range.
#include "machine/room.h"

#include <gtest/gtest.h>

#include "machine/load.h"
#include "tests/support/module_machine.h"
#include "tests/support/places.h"
#include "tests/support/two_cylinders.h"

namespace knuckle {
namespace {

MachineDescription machine_named(const std::string& name) {
  return load_machine(test::source_dir() + "/config/machines/" + name + ".toml");
}

TEST(Room, ShippedMachinesHaveWallsOutsideTheirWorkingRange) {
  for (const char* name : {"solar015", "compact080", "standard200"}) {
    for (const std::string& note : machine_notes(machine_named(name)))
      EXPECT_EQ(note.find("limits."), note.npos) << note;
  }
}

TEST(Room, AnotherMachinesReachIsToldWithWhatItCutsOff) {
  MachineDescription machine = machine_named("compact080");
  machine.limits.reach_m = machine_named("solar015").limits.reach_m;
  const auto notes = machine_notes(machine);
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_EQ(notes[0].rfind("limits.reach_m = 3.3 of machine 'compact080' cuts off ", 0), 0U) << notes[0];
  EXPECT_NE(notes[0].find("the tip goes to 6."), std::string::npos) << notes[0];
  machine.limits.floor_m = -1;
  machine.limits.ceiling_m = 1;
  EXPECT_EQ(machine_notes(machine).size(), 3U);
}

TEST(Room, WhatACylinderWithoutTransmittersCostsIsTold) {
  const auto notes = machine_notes(parse_machine(test::without_transmitters("boom"), "m.toml"));
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_EQ(notes[0].rfind("sensors.without_pressures = boom: forces rest on the two other cylinders", 0), 0U);
}

/// Nobody can prove that what moves nothing ends a motion.
TEST(Room, AProofIsAskedForOfWhatMovesAJointAlone) {
  std::string text = test::module_text();
  text.insert(text.find("\n[limits]"), std::string("\n") + test::kSpareModule + test::kConstants);
  std::string all;
  for (const std::string& note : machine_notes(parse_machine(text, "m.toml"))) all += note + '\n';
  EXPECT_NE(all.find("the outputs of module take their error values"), std::string::npos) << all;
  EXPECT_EQ(all.find("the outputs of spare"), std::string::npos) << all;
  EXPECT_EQ(all.find("own controller ends all motion"), std::string::npos) << all;
}

TEST(Room, TheStretchedArmIsAmongThePosesLookedAt) {
  MachineDescription machine = machine_named("solar015");
  double furthest_m = 0;
  for (const WallRoom& room : wall_rooms(machine))
    if (room.key == std::string("reach_m")) furthest_m = room.reached_m;
  EXPECT_LE(furthest_m, reach_m(machine));
  EXPECT_GT(furthest_m, 0.9 * reach_m(machine));
}

}  // namespace
}  // namespace knuckle
