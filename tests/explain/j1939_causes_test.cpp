// What explain says of J1939: who sends a group, whose an address is, and packets that were lost.
#include <gtest/gtest.h>

#include "app/explain/cause.h"
#include "app/explain/timeline.h"
#include "machine/reason_text.h"
#include "tests/support/j1939_machine.h"
#include "tests/support/lines.h"
#include "tests/support/says.h"
#include "transport/j1939_packets.h"

namespace knuckle::explain {
namespace {

struct Overheard {
  void hears(const CanFrame& frame) {
    window.can.push_back({now, WireEventKind::kCanReceived, frame});
    now += 10ms;
  }
  [[nodiscard]] Cause cause(const Reason& reason, const MachineDescription& machine) {
    const Stop stop{.at = now, .reason = reason};
    window.to = now;
    return likely_cause(stop, window, evidence_of(stop, window, machine), machine);
  }
  Window window;
  Time now{100s};
};

TEST(ExplainJ1939, NamesBothSendersOfAGroupAndSinceWhenThereIsASecond) {
  const MachineDescription machine = test::j1939_machine("id = 0x18FF1021", "pgn = 0xFF10");
  Overheard bus;
  for (int i = 0; i < 5; ++i) bus.hears({0x18FF1021U | kExtendedId, 8, {}});
  bus.hears({0x18FF1077U | kExtendedId, 8, {}});
  bus.hears({0x18FF1021U | kExtendedId, 8, {}});
  const Cause cause =
      bus.cause({ReasonCode::kGroupTwice, subject_of(NodeRole::kEncoder, kArm, machine.bus), 0x77, 0x21}, machine);
  EXPECT_EQ(cause.id, "group_twice");
  EXPECT_TRUE(test::says(cause.text, "front_angle (PGN 0xFF10), arm_angle: two devices send"));
  EXPECT_EQ(test::lines_of(cause.supports),
            "0x21 sent it 6 times, first at 100.000 s\n0x77 sent it 1 times, first at 100.050 s\n");
  EXPECT_EQ(cause.since, Time(100050ms));
}

TEST(ExplainJ1939, NamesWhoTookTheAddress) {
  const MachineDescription machine = test::commanded_j1939_machine();
  Overheard bus;
  bus.hears(j1939::claim_frame(0x17, 0x06));
  bus.hears(j1939::claim_frame(0x11, 0x05));
  const Cause cause = bus.cause({ReasonCode::kAddressLost, 0, 5, 0}, machine);
  EXPECT_EQ(cause.id, "address_lost");
  EXPECT_EQ(test::lines_of(cause.supports), "claimed by NAME 0x0000000000000011 at 100.010 s; the lower NAME has it\n");
  EXPECT_EQ(cause.since, Time(100010ms));
}

TEST(ExplainJ1939, NotesLostPacketsAndOtherDevicesAndKnowsPacketsForTheMachines) {
  const MachineDescription machine = parse_machine(test::packets_text(), "m.toml");
  Overheard bus;
  const std::vector<std::uint8_t> message(20, 7);
  bus.hears(j1939::announcement_frame(0x1FF60, 0x21, 20));
  bus.hears(j1939::packet_frame(0x21, 2, message));
  bus.hears(j1939::claim_frame(0x17, 0x21));
  bus.hears(j1939::claim_frame(0x18, 0x21));
  const std::string notes = test::lines_of(j1939_notes(bus.window, machine));
  EXPECT_TRUE(test::says(notes, "at 100.010 s: coolant (PGN 0x1FF60): packet 1 of 3 from 0x21 did not come"));
  EXPECT_TRUE(
      test::says(notes, "at 100.030 s: coolant (PGN 0x1FF60): its sender's address 0x21 is claimed by another"));
  Stop stop;
  stop.at = bus.now;
  EXPECT_TRUE(evidence_of(stop, bus.window, machine).foreign.empty());
}

}  // namespace
}  // namespace knuckle::explain
