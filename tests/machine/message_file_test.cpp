// Groups of more than 8 bytes in machine files: what is read, and what is refused in one line.
#include <gtest/gtest.h>

#include "machine/bus_budget.h"
#include "tests/support/j1939_machine.h"
#include "tests/support/refusal.h"

namespace knuckle {
namespace {

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
  struct Case {
    const char *from, *to, *said;
  };
  for (const Case& c : {
           Case{"bytes = 20", "bytes = 256", "must be a whole number within [1, 255]"},
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
       }) {
    const std::string line = test::refusal([&] { (void)parse_machine(test::packets_text(c.from, c.to), "m.toml"); });
    EXPECT_NE(line.find(c.said), std::string::npos) << c.to << ": " << line;
  }
  EXPECT_EQ(test::refusal([] { (void)parse_machine(test::packets_text("start = 137", "start = 60"), "m.toml"); }),
            "accepted")
      << "right behind the other";
}

}  // namespace
}  // namespace knuckle
