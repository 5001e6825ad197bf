// [[bus.broadcast]] with a multiplexer: several frames under one identifier.
#include <gtest/gtest.h>

#include "machine/bus_budget.h"
#include "tests/support/multiplexed_machine.h"
#include "tests/support/refusal.h"

namespace knuckle {
namespace {

using test::multiplexed_machine;

TEST(MultiplexedFile, SaysWhichFramesOfAnIdentifierHaveAValue) {
  const BusDescription bus = multiplexed_machine().bus;
  const BroadcastFrame &angles = bus.broadcasts.at(0), &pressures = bus.broadcasts.at(1);
  EXPECT_EQ(angles.id, pressures.id);
  EXPECT_EQ(pressures.name, "pressure_1");
  const CanFrame first{angles.id, 8, {0, 0, 0, 0, 0, 0, 0, 1}}, third{angles.id, 8, {0, 0, 0, 0, 0, 0, 0, 3}},
      cut{angles.id, 7, {}};
  EXPECT_TRUE(angles.is_in(first) && !pressures.is_in(first));
  EXPECT_FALSE(angles.is_in(third) || pressures.is_in(third)) << "one that the file does not have";
  EXPECT_FALSE(angles.is_in(cut)) << "without the multiplexer";
}

TEST(MultiplexedFile, EachFrameCountsForTheBudget) {
  const auto without = [](const char* period) {
    return worst_bus_load(multiplexed_machine("period_ms = 10", period).bus);
  };
  EXPECT_NEAR(without("period_ms = 10") - without("period_ms = 20"), 50 * 160 / 500e3, 1e-9);
}

TEST(MultiplexedFile, WhatDoesNotTellFramesApartIsRefusedInOneLine) {
  struct Case {
    const char *from, *to, *said;
  };
  for (const Case& c : {
           Case{"value = 2", "value = 1", "bus.broadcast[1].multiplexer'"},
           {"value = 2", "value = 1", "has value 1, as that of 'front_angle'"},
           {"value = 2", "value = 256", "must be a whole number within [0, 255]"},
           {"multiplexer = { start = 56, bits = 8, value = 2 }\n", "",
            "is taken by 'front_angle': both must have a multiplexer"},
           {"multiplexer = { start = 56, bits = 8, value = 1 }\n", "",
            "is taken by 'front_angle': both must have a multiplexer"},
           {"start = 56, bits = 8, value = 2", "start = 52, bits = 8, value = 2",
            "must have the bits of that of 'front_angle'"},
           {"start = 56, bits = 8, value = 1", "start = 8, bits = 8, value = 1", "has bits of the multiplexer"},
           {"start = 56, bits = 8, value = 1", "start = 48, bits = 8, value = 1", "has bits of the multiplexer"},
           {"start = 56, bits = 8, value = 1", "start = 0, bits = 32, type = \"float\", value = 1",
            "must be at most 32 of an unsigned"},
           {"counter = { start = 48, bits = 4 }\n", "", "must be as of 'front_angle', which has the same identifier"},
           {"bytes = 8\nperiod_ms = 10\nmultiplexer = { start = 56, bits = 8, value = 2 }",
            "bytes = 7\nperiod_ms = 10\nmultiplexer = { start = 40, bits = 8, value = 2 }",
            "must be 8, as of 'front_angle' under the same identifier"},
       }) {
    const std::string line = test::refusal([&] { (void)multiplexed_machine(c.from, c.to); });
    EXPECT_NE(line.find(c.said), std::string::npos) << c.to << ": " << line;
    EXPECT_EQ(line.rfind("m.toml:", 0), 0U) << line;
  }
}

}  // namespace
}  // namespace knuckle
