// Commands of auxiliary valves (ISO 11783-7) and directions in machine files: what is read, and what is refused.
#include <gtest/gtest.h>

#include <string>

#include "machine/set_points.h"
#include "tests/support/j1939_machine.h"
#include "tests/support/refused_changes.h"
#include "tests/support/two_buses.h"

namespace knuckle {
namespace {

TEST(ValveCommandFile, IsAFrameOfItsGroupWithAllItsBits) {
  const BusDescription bus = test::valves_machine().bus;
  EXPECT_EQ(bus.command_kind, CommandKind::kFlow);
  ASSERT_EQ(bus.commands.size(), 3U);
  const CommandFrame& boom = bus.commands[0];
  EXPECT_EQ(boom.id, 0x0CFE3326U | kExtendedId) << "priority 3, valve 3, from the address";
  EXPECT_EQ(boom.bytes, 8);
  EXPECT_EQ(boom.period_s, 0.02);
  EXPECT_FALSE(boom.always) << "while somebody leads";
  EXPECT_TRUE(boom.filter().lets(0x18FE3377U | kExtendedId)) << "another's";
  EXPECT_FALSE(boom.filter().lets(0x0CFE3026U | kExtendedId));
  const CommandField* const up = bus.command(kBoom, true);
  ASSERT_NE(up, nullptr);
  EXPECT_EQ(up, bus.command(kBoom, false));
  EXPECT_NEAR(*up->extend, 1, 1e-12);
  EXPECT_NEAR(*up->retract, 0.8, 1e-12);
  EXPECT_EQ(bus.commands[1].id, 0x0CFE3026U | kExtendedId);
  EXPECT_EQ(bus.commands[1].period_s, 0.01);
  EXPECT_EQ(bus.command(kArm, true)->direction->extend, 2U) << "the other way round";
  EXPECT_TRUE(bus.commands_by_address());
}

TEST(ValveCommandFile, AWayThatIsNoneIsNoNeutral) {
  const BusDescription bus = test::valves_machine().bus;
  const auto said = [&](std::uint8_t flow, std::uint8_t state) {
    return set_point_in({bus.commands[0].id, 8, {flow, 0xFF, state, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}}, kBoom, bus).value();
  };
  EXPECT_EQ(said(0, 0x30), 0);
  EXPECT_EQ(said(125, 0x30), 0) << "blocked";
  EXPECT_NEAR(said(125, 0x31), 0.5, 1e-9);
  EXPECT_NEAR(said(100, 0x32), -0.5, 1e-9);
  EXPECT_NE(said(0, 0x33), 0) << "float moves by the load";
  EXPECT_NE(said(0, 0x3F), 0);
}

TEST(ValveCommandFile, WhatCannotBeIsRefusedInOneLine) {
  test::expect_refused(
      {
          {"iso11783_valve = 3", "iso11783_valve = 16", "must be a whole number within [0, 15]"},
          {"iso11783_valve = 3", "iso11783_valve = 0", "is taken by 'iso11783_valve_0'"},
          {"joint = \"arm\"", "joint = \"boom\"", "moves the boom as boom_flow of 'iso11783_valve_3' does"},
          {"retract = 80", "", "bus.command[0].retract' is missing"},
          {"retract = 80", "retract = 80.1", "cannot be said by these bits: nearest is 80"},
          {"retract = 80", "retract = 102", "must be within [40, 100]"},
          {"retract = 80", "retract = 20", "must be within [40, 100]"},
          {"period_ms = 10", "period_ms = 30", "must be at most 25, half of bus.valve_watchdog_ms"},
          {"reversed = true", "reversed = true\nsend = \"always\"", "send"},
      },
      [](const auto& from, const auto& to) { (void)parse_machine(test::valves_text(from, to), "m.toml"); });
  const std::string second = R"(
[[bus.broadcast]]
name = "valve_of_another"
id = 0x18FE3321
bytes = 8
period_ms = 100
[bus.broadcast.signals]
fuel_level = { start = 0, bits = 8, scale = 0.4, unit = "%" }
)";
  const std::string taken = test::machine_refusal(test::valves_text("[[bus.command]]", second + "[[bus.command]]"));
  EXPECT_TRUE(test::says(taken, "is taken by 'valve_of_another'")) << "whatever priority and source";
  EXPECT_TRUE(test::says(test::machine_refusal(test::valves_text("", "", "")), "needs bus.j1939_address"));
}

TEST(DirectionFile, WhatCannotBeIsRefusedInOneLine) {
  test::expect_refused(
      {
          {"start = 10, bits = 2", "start = 8, bits = 2", "has bits of its own direction"},
          {"start = 10, bits = 2", "start = 16, bits = 2", "has bits of arm"},
          {"start = 10, bits = 2", "start = 10, bits = 9", "must be at most 8 of an unsigned"},
          {"neutral = 0, extend = 1, retract = 2 }", "neutral = 0, extend = 1, retract = 1 }",
           "must not be that of neutral or extend"},
          {"neutral = 0, extend = 1, retract = 2 }", "neutral = 1, extend = 1, retract = 2 }",
           "must not be that of neutral"},
          {"neutral = 0, extend = 1, retract = 2 }", "neutral = 0, extend = 4, retract = 2 }",
           "must be a whole number within [0, 3]"},
          {"neutral = 0, extend = 1, retract = 2 }", "extend = 1, retract = 2 }", "direction.neutral' is missing"},
          {"extend = 100, retract = 100, direction", "extend = 100, direction", "needs extend and retract"},
          {"neutral = 0, extend = 100, retract = 100", "neutral = 50, extend = 100, retract = 0",
           "must be on the same side of neutral as extend"},
          {"id = 0x18FF0505\nbytes = 6", "id = 0x0CFE3205\nbytes = 6", "can let the valve float"},
      },
      [](const auto& from, const auto& to) { (void)test::command_machine(test::kFlowCommands, from, to); });
}

/// In a command of an auxiliary valve that is written out.
TEST(DirectionFile, FloatIsRefusedWhereverItCouldBeSaid) {
  const auto line_of = [](const std::string& field, const std::string& constant) {
    const std::string valve =
        "[[bus.command]]\nname = \"valve\"\nid = 0x0CFE3105\nbytes = 8\nperiod_ms = 10\nsend = "
        "\"always\"\n[bus.command.fields]\n" +
        field + "\n" + constant + "\n";
    return test::machine_refusal(test::command_text(valve));
  };
  const auto flow = [](const std::string& direction) {
    return "boom = { start = 0, bits = 8, scale = 0.4, unit = \"%\", joint = \"boom\", neutral = 0, extend = 100, "
           "retract = 100, direction = { " +
           direction + " } }";
  };
  const std::string good = flow("start = 16, bits = 4, neutral = 0, extend = 1, retract = 2"),
                    reserved = "rest = { start = 20, bits = 2, neutral = 3 }";
  const char* const floats = "can let the valve float: state 3 of ISO 11783-7";
  EXPECT_FALSE(test::says(line_of(good, reserved), floats)) << "only that the others are missing";
  for (const char* direction : {"start = 16, bits = 4, neutral = 3, extend = 1, retract = 2",
                                "start = 16, bits = 4, neutral = 0, extend = 3, retract = 2",
                                "start = 16, bits = 4, neutral = 0, extend = 1, retract = 3",
                                "start = 17, bits = 2, neutral = 0, extend = 1, retract = 2"})
    EXPECT_TRUE(test::says(line_of(flow(direction), reserved), floats)) << direction;
  const std::string elsewhere = flow("start = 40, bits = 4, neutral = 0, extend = 1, retract = 2");
  EXPECT_TRUE(test::says(line_of(elsewhere, "state = { start = 16, bits = 4, neutral = 3 }"), floats));
  EXPECT_TRUE(test::says(line_of(elsewhere, "state = { start = 16, bits = 4, neutral = 0, led = 3 }"), floats));
  EXPECT_FALSE(test::says(line_of(elsewhere, "state = { start = 16, bits = 4, neutral = 0 }"), floats));
  EXPECT_TRUE(test::says(line_of(elsewhere, "[bus.command.counter]\nstart = 16\nbits = 4"), floats));
}

}  // namespace
}  // namespace knuckle
