// --can of a machine with one bus and of one with two.
#include "app/bringup/can_interfaces.h"

#include <gtest/gtest.h>

#include "app/bringup/planned_faults.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/two_buses.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::says;
using Names = std::vector<std::string>;

BusDescription one() {
  return parse_machine(test::broadcast_text(), "m.toml").bus;
}
BusDescription two() {
  return parse_machine(test::two_buses_text(), "m.toml").bus;
}

TEST(CanInterfaces, AreInTheOrderOfTheMachineFile) {
  EXPECT_EQ(can_interfaces({"can0"}, one()), Names{"can0"});
  EXPECT_EQ(can_interfaces({"machine=can1", "valves=can0"}, two()), (Names{"can0", "can1"}));
  BusDescription named = one();
  named.name = "valves";
  EXPECT_EQ(can_interfaces({"valves=can0"}, named), Names{"can0"});
  EXPECT_EQ(can_interfaces({"can0"}, named), Names{"can0"});
  EXPECT_EQ(can_text({"valves=can0", "machine=can1"}), "valves=can0 and machine=can1");
}

/// Or a commissioning could not go on by a command that gives the same ones.
TEST(CanInterfaces, HaveOneNameInWhateverOrderTheyAreGiven) {
  EXPECT_EQ(can_text({"machine=can1", "valves=can0"}, two()), "valves=can0 and machine=can1");
  EXPECT_EQ(can_text({"valves=can0", "machine=can1"}, two()), "valves=can0 and machine=can1");
  EXPECT_EQ(can_text({"can0"}, one()), "can0");
}

TEST(CanInterfaces, WhatIsMissingUnknownOrGivenTwiceIsRefusedInOneLine) {
  struct Case {
    Names given;
    BusDescription bus;
    const char* said;
  };
  for (const Case& c : {
           Case{{"can0"}, two(), "--can can0: the machine has two buses: must be NAME=INTERFACE with valves, machine"},
           {{"valves=can0"}, two(), "--can: needs machine=INTERFACE, too"},
           {{"valves=can0", "tracks=can1"}, two(), "--can tracks=can1: no bus \"tracks\"; there are valves, machine"},
           {{"valves=can0", "valves=can1"}, two(), "--can valves=can1: this bus was given before"},
           {{"valves=can0", "machine=can0"}, two(), "--can machine=can0: is the interface of the other bus"},
           {{"valves=can0", "machine="}, two(), "--can: needs machine=INTERFACE, too"},
           {{"valves=can0"}, one(), "--can valves=can0: no bus \"valves\"; the machine has one, without a name"},
           {{"can0", "can1"}, one(), "--can can1: this bus was given before"},
           {{}, one(), "--can: needs INTERFACE, too"},
       })
    EXPECT_EQ(test::refusal([&] { return can_interfaces(c.given, c.bus); }), c.said);
}

TEST(CanInterfaces, AFaultOfABusSaysWhich) {
  EXPECT_EQ(parse_fault("bus_cut:machine@3+1", two()).node, 1);
  EXPECT_EQ(parse_fault("babble:valves@usr1", two()).node, 0);
  EXPECT_TRUE(says(test::refusal([] { return parse_fault("bus_cut@3", two()); }), "there are valves, machine"));
  EXPECT_TRUE(says(test::refusal([] { return parse_fault("bus_cut:tracks@3", two()); }), "no bus \"tracks\""));
  EXPECT_TRUE(says(test::refusal([] { return parse_fault("bus_cut:machine@3", one()); }), "takes no node"));
}

}  // namespace
}  // namespace knuckle::bringup
