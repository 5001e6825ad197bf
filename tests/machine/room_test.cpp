// What limits leave of the working range.
#include "machine/room.h"

#include <gtest/gtest.h>

#include "tests/support/module_machine.h"
#include "tests/support/says.h"
#include "tests/support/shipped.h"
#include "tests/support/two_cylinders.h"

namespace knuckle {
namespace {

TEST(Room, ShippedMachinesHaveWallsOutsideTheirWorkingRange) {
  for (const char* name : {"solar015", "compact080", "standard200"}) {
    for (const std::string& note : machine_notes(test::shipped(name))) EXPECT_FALSE(test::says(note, "limits."));
  }
}

TEST(Room, AnotherMachinesReachIsToldWithWhatItCutsOff) {
  MachineDescription machine = test::shipped("compact080");
  machine.limits.reach_m = test::shipped("solar015").limits.reach_m;
  const auto notes = machine_notes(machine);
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_TRUE(test::begins(notes[0], "limits.reach_m = 3.3 of machine 'compact080' cuts off "));
  EXPECT_TRUE(test::says(notes[0], "the tip goes to 6."));
  machine.limits.floor_m = -1;
  machine.limits.ceiling_m = 1;
  EXPECT_EQ(machine_notes(machine).size(), 3U);
}

TEST(Room, WhatACylinderWithoutTransmittersCostsIsTold) {
  const auto notes = machine_notes(parse_machine(test::without_transmitters("boom"), "m.toml"));
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_TRUE(test::begins(notes[0], "sensors.without_pressures = boom: forces rest on the two other cylinders"));
}

/// Nobody can prove that what moves nothing ends a motion.
TEST(Room, AProofIsAskedForOfWhatMovesAJointAlone) {
  std::string text = test::module_text();
  text.insert(text.find("\n[limits]"), std::string("\n") + test::kSpareModule + test::kConstants);
  std::string all;
  for (const std::string& note : machine_notes(parse_machine(text, "m.toml"))) all += note + '\n';
  EXPECT_TRUE(test::says(all, "the outputs of module take their error values"));
  EXPECT_FALSE(test::says(all, "the outputs of spare"));
  EXPECT_FALSE(test::says(all, "own controller ends all motion"));
}

TEST(Room, TheStretchedArmIsAmongThePosesLookedAt) {
  MachineDescription machine = test::shipped("solar015");
  double furthest_m = 0;
  for (const WallRoom& room : wall_rooms(machine))
    if (room.key == std::string("reach_m")) furthest_m = room.reached_m;
  EXPECT_LE(furthest_m, reach_m(machine));
  EXPECT_GT(furthest_m, 0.9 * reach_m(machine));
}

}  // namespace
}  // namespace knuckle
