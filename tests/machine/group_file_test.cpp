// J1939 parameter groups in machine files: what is read, and what is refused in one line.
#include <gtest/gtest.h>

#include <numbers>

#include "machine/bus_budget.h"
#include "machine/reason_text.h"
#include "tests/support/j1939_machine.h"
#include "tests/support/refused_changes.h"
#include "tests/support/two_buses.h"

namespace knuckle {
namespace {

const BroadcastFrame& group(const BusDescription& bus, int reading) {
  return *bus.broadcast(NodeRole::kReading, reading).frame;
}

TEST(GroupFile, IsReadByGroupSourceAndLength) {
  const BusDescription bus = test::j1939_machine().bus;
  EXPECT_EQ(bus.j1939_address, 0xF9);
  const auto [engine, speed] = bus.broadcast(NodeRole::kReading, 0);
  EXPECT_TRUE(engine->is_group());
  EXPECT_EQ(engine->source, 0x00);
  EXPECT_EQ(engine->period_s, 0.02);
  EXPECT_FALSE(engine->on_request);
  EXPECT_TRUE(engine->filter().lets(0x0CF00400U | kExtendedId));
  EXPECT_TRUE(engine->filter().lets(0x18F00417U | kExtendedId)) << "to tell it";
  EXPECT_FALSE(engine->filter().lets(0x18F00300U | kExtendedId));
  EXPECT_EQ(speed->invalid_from, 0xFB00U) << "by its length";
  EXPECT_NEAR(value_of(speed->bits, 14400), 1800 * 2 * std::numbers::pi / 60, 1e-9);
  EXPECT_EQ(bus.broadcast(NodeRole::kReading, kEngineRunningIndex).field->invalid_from, 0xEU);
  const auto [hours, time] = bus.broadcast(NodeRole::kReading, 4);
  EXPECT_TRUE(hours->on_request);
  EXPECT_EQ(hours->period_s, 10);
  EXPECT_EQ(time->invalid_from, 0xFB000000U);
  EXPECT_NEAR(value_of(time->bits, 20), 3600, 1e-6);
  EXPECT_EQ(frame_text(*engine, bus), "engine (PGN 0xF004 of 0x00)");
  EXPECT_EQ(frame_text(group(bus, 3), bus), "coolant (PGN 0xFEEE)");
}

TEST(GroupFile, WhatIsNoneMayBeSaidOtherwise) {
  const auto none_of = [](const std::string& said) {
    return test::j1939_machine("offset = -40, unit = \"degC\"", "offset = -40, unit = \"degC\"" + said)
        .bus.broadcast(NodeRole::kReading, 3)
        .field->invalid_from;
  };
  EXPECT_EQ(none_of(""), 0xFBU);
  EXPECT_EQ(none_of(", invalid = \"j1939\""), 0xFBU);
  EXPECT_EQ(none_of(", invalid_from = 0xFE"), 0xFEU);
  EXPECT_EQ(none_of(", invalid = \"none\""), std::nullopt);
  const MachineDescription machine =
      test::j1939_machine("sign = -1, zero_rad = 0.12", "sign = -1, zero_rad = 0.12, invalid = \"j1939\"");
  const auto angle = machine.bus.broadcast(NodeRole::kEncoder, kBoom);
  EXPECT_EQ(angle.field->invalid_from, 0xFB00U) << "also where the frame is no group";
}

TEST(GroupFile, WhatTheMachineIsLedByMayBeAGroupAsWell) {
  const BusDescription bus = test::j1939_machine("id = 0x18FF1021", "pgn = 0xFF10").bus;
  const auto [frame, boom] = bus.broadcast(NodeRole::kEncoder, kBoom);
  EXPECT_TRUE(frame->is_group());
  EXPECT_EQ(boom->invalid_from, 0xFB00U);
  EXPECT_FALSE(bus.broadcast(NodeRole::kEncoder, kBucket).field->invalid_from) << "signed";
  const Reason twice{ReasonCode::kGroupTwice, subject_of(NodeRole::kEncoder, kBoom, bus), 0x17, 0x21};
  EXPECT_TRUE(test::begins(text(twice, bus), "front_angle (PGN 0xFF10), boom_angle: two devices send"));
  EXPECT_TRUE(test::says(text(twice, bus), "(0x17 beside 0x21)"));
}

TEST(GroupFile, CommandsFromTheAddressAreKnownFromOtherSourcesToo) {
  const BusDescription bus = test::commanded_j1939_machine().bus;
  EXPECT_TRUE(bus.commands_by_address());
  EXPECT_TRUE(bus.commands[0].filter().lets(0x0CFF0127U | kExtendedId));
  EXPECT_FALSE(bus.commands[0].filter().lets(0x18FF0205U | kExtendedId));
  EXPECT_EQ(bus.commands[1].mask, CanFilter::kWhole) << "11 bits";
  EXPECT_FALSE(test::command_machine().bus.commands_by_address());
}

TEST(GroupFile, WhatCannotBeIsRefusedInOneLine) {
  test::expect_refused(
      {
          {"pgn = 0xFEEE", "pgn = 0x20000", "key 'bus.broadcast[4].pgn' = 0x20000: must be a whole number within"},
          {"pgn = 0xFEEE", "pgn = 0xEF21", "must end with 00: the last byte is the receiver's address"},
          {"pgn = 0xFEEE", "pgn = 0xFE68", "is taken by 'coolant'"},
          {"pgn = 0xFEEE", "pgn = 0xF004\nsource = 0x00", "is taken by 'engine'"},
          {"pgn = 0xFEEE", "pgn = 0xF004", "is taken by 'engine'"},
          {"pgn = 0xFEEE", "pgn = 0xFF10", "is taken by 'front_angle'"},
          {"pgn = 0xFEEE", "pgn = 0xFEEE\nsource = 0xF9", "is Knuckle's own address"},
          {"pgn = 0xFEEE", "pgn = 0xFEEE\nsource = 0xFE", "must be a whole number within [0, 253]"},
          {"pgn = 0xFEEE", "pgn = 0xFEEE\nid = 0x18FEEE00", "id"},
          {"id = 0x1A5", "id = 0x1A5\nsource = 0x00", "source"},
          {"id = 0x1A5", "id = 0x1A5\nrequest_every_s = 10", "request_every_s"},
          {"id = 0x18FF1021\nbytes = 8\nperiod_ms = 10", "pgn = 0xFF10\nbytes = 8\nrequest_every_s = 10",
           "is for values that people are told"},
          {"request_every_s = 10", "request_every_s = 10\nperiod_ms = 10", "period_ms"},
          {"request_every_s = 10", "request_every_s = 0.5", "must be within [1, 3600]"},
          {"unit = \"V\"", "unit = \"bar\"", "must be one of"},
          {"scale = 0.05, unit = \"V\"", "scale = 0.05, unit = \"V\", invalid = \"j1939\", invalid_from = 5",
           "stands beside invalid_from: keep one of the two"},
          {"bits = 16, scale = 0.05, unit = \"V\"", "bits = 7, scale = 0.05, unit = \"V\", invalid = \"j1939\"",
           "J1939 says it of unsigned values of 2, 4 and at least 8 bits"},
          {"on = 0", "on = 14", "is said to be none by invalid_from"},
      },
      test::j1939_machine);
}

TEST(GroupFile, TwoSourcesOfAGroupAreTwoFrames) {
  const BusDescription bus = test::j1939_machine("pgn = 0xFEEE", "pgn = 0xF004\nsource = 0x17").bus;
  EXPECT_EQ(group(bus, 3).source, 0x17);
}

TEST(GroupFile, AnAddressGoesWithWhatNeedsOneAlone) {
  EXPECT_TRUE(test::says(test::machine_refusal(test::j1939_text("", "", "")), "needs bus.j1939_address"));
  const std::string unused = test::machine_refusal(test::with_address(test::broadcast_text(), "0xF9"));
  EXPECT_TRUE(test::says(unused, "'bus.j1939_address' = 0xF9: is used by nothing"));
  const std::string commands =
      test::command_text(test::kRateCommands, std::string(test::kStateBroadcast) + test::kGroups);
  const std::string apart = test::machine_refusal(test::on_two_buses(test::with_address(commands, "0x05")));
  EXPECT_TRUE(test::says(apart, "is one bus's alone")) << "commands on the one, requests on the other";
  EXPECT_TRUE(
      test::says(test::machine_refusal(test::j1939_text("", "", "0xFE")), "must be a whole number within [0, 253]"));
}

// Groups of more than 8 bytes.

TEST(MessageFile, CountsItsBitsFromTheFirstByteOfAll) {
  const BusDescription bus = parse_machine(test::packets_text(), "m.toml").bus;
  const auto [frame, fuel] = bus.broadcast(NodeRole::kReading, 6);
  EXPECT_EQ(frame->bytes, 20);
  EXPECT_EQ(fuel->first_byte, 17);
  EXPECT_EQ(fuel->bits.start_bit, 1);
  EXPECT_EQ(fuel->invalid_from, 0xFBU) << "by its length";
  EXPECT_EQ(bus.broadcast(NodeRole::kReading, 3).field->first_byte, 6);
  EXPECT_EQ(bus.broadcast(NodeRole::kReading, 0).field->first_byte, 0) << "of a frame";
}

TEST(MessageFile, CountsForTheLoadByItsPackets) {
  const BusDescription bus = parse_machine(test::packets_text(), "m.toml").bus;
  BusDescription without = bus;
  std::erase_if(without.broadcasts, [](const BroadcastFrame& frame) { return frame.bytes == 20; });
  // One announcement and three packets a second, at worst 160 bits each.
  EXPECT_NEAR(worst_bus_load(bus) - worst_bus_load(without), 4 * 160 / 500e3, 1e-9);
}

TEST(MessageFile, WhatCannotBeIsRefusedInOneLine) {
  test::expect_refused(
      {
          {"bytes = 20", "bytes = 256", "must be a whole number within [1, 255]"},
          {"id = 0x1A5\nbytes = 4", "id = 0x1A5\nbytes = 9", "must be at most 8: only a group, by pgn"},
          {"bytes = 20\nperiod_ms = 1000", "bytes = 20\nperiod_ms = 100",
           "must be at least 150: 3 packets come 50 ms apart"},
          {"bytes = 20\nperiod_ms = 1000", "bytes = 20\nperiod_ms = 11000", "must be within [1, 10000]"},
          {"bytes = 20\nperiod_ms = 1000", "bytes = 18\nperiod_ms = 1000",
           "with 8 bits it ends outside the message's 18 bytes"},
          {"start = 137", "start = 160", "must be a whole number within [0, 159]"},
          {"start = 137, bits = 8", "start = 81, bits = 64", "must end within 8 bytes from the first one"},
          {"start = 137, bits = 8", "start = 137, bits = 8, order = \"big\"", "must be little"},
          {"start = 137", "start = 59", "has bits of"},
          {"start = 137", "start = 45", "has bits of"},
          {"bytes = 20\nperiod_ms = 1000", "bytes = 20\nperiod_ms = 1000\ncounter = { start = 0, bits = 4 }",
           "does not go with a message of several packets"},
          {"id = 0x18FF2021\nbytes = 6\nperiod_ms = 10", "pgn = 0xFF20\nbytes = 9\nperiod_ms = 100",
           "must be at most 8 of what moves the machine or stops it"},
      },
      [](const auto& from, const auto& to) { (void)parse_machine(test::packets_text(from, to), "m.toml"); });
  EXPECT_EQ(test::machine_refusal(test::packets_text("start = 137", "start = 60")), "accepted")
      << "right behind the other";
}

}  // namespace
}  // namespace knuckle
