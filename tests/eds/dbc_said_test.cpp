// `knuckle bus import`: what a person says of messages beside their signals, where a DBC does not: counters, periods.
#include <gtest/gtest.h>

#include "tests/eds/imports.h"

namespace knuckle::eds {
namespace {

using test::bus_of;
using test::replaced;
using test::roomy_text;
using test::says;

Import said_import(const ImportOptions& said, const std::string& machine = roomy_text(),
                   const std::string& dbc = test::kSentDbc) {
  return test::imported(said, dbc, machine);
}

FrameClosing closing_of_slope(const Import& import) {
  return bus_of(import).broadcast(NodeRole::kTilt, 0).frame->closing;
}

TEST(DbcSaid, CounterAndChecksumOfWhatTheMachineSendsAreSaidAsThoseOfCommands) {
  const Import import = said_import(
      {.signals = {"slope=Body.slope"}, .counters = {"Body.alive=15"}, .checksums = {"Body.crc=crc8-j1850"}});
  const FrameClosing closing = closing_of_slope(import);
  ASSERT_TRUE(closing.counter && closing.checksum);
  EXPECT_EQ(closing.counter->field.start_bit, 48);
  EXPECT_EQ(closing.counter->modulus, 15U);
  EXPECT_EQ(closing.checksum->kind, FrameChecksum::Kind::kCrc8J1850);
  EXPECT_EQ(import.frames,
            (std::vector<std::string>{"Body (0x1AA): counter alive, checksum crc", "Body (0x1AA): slope"}));
  EXPECT_EQ(import.gone_nodes, std::vector<std::string>{"tilt"}) << "valves and enable stay: nothing is told by frames";
}

TEST(DbcSaid, ACounterIsAddedToTheTableThatIsThere) {
  const std::string before = said_import({.signals = {"slope=Body.slope"}}).text;
  const Import all = said_import({.counters = {"Body.alive"}}, before);
  EXPECT_EQ(closing_of_slope(all).counter->modulus, 0U) << "all that its bits can count";
  const std::string by_hand = replaced(all.text, "bits = 4 }", "bits = 4, modulus = 15 }   # it does");
  EXPECT_EQ(said_import({.counters = {"Body.alive"}}, by_hand).text, by_hand);
  EXPECT_EQ(said_import({.counters = {"Body.alive=14"}}, by_hand).text,
            replaced(by_hand, "modulus = 15", "modulus = 14"));
}

TEST(DbcSaid, FramesUnderOneIdentifierHaveOneCounter) {
  const ImportOptions one{.signals = {"slope=Mixed.slope"}, .counters = {"Mixed.alive"}},
      other{.signals = {"arm_angle=Mixed.arm"}},
      both{.signals = {"slope=Mixed.slope", "arm_angle=Mixed.arm"}, .counters = {"Mixed.alive"}};
  for (const Import& import : {said_import(both), said_import(other, said_import(one).text),
                               said_import(both, said_import(other).text), said_import(both, said_import(one).text)}) {
    const BusDescription bus = bus_of(import);
    ASSERT_EQ(bus.broadcasts.size(), 2U);
    for (const BroadcastFrame& frame : bus.broadcasts) {
      ASSERT_TRUE(frame.closing.counter) << frame.name;
      EXPECT_EQ(frame.closing.counter->field.start_bit, 56);
    }
  }
}

constexpr const char* kKinds =
    "BA_DEF_ SG_ \"SigType\" ENUM \"Default\",\"Range\",\"MessageCounter\";\nBA_DEF_DEF_ \"SigType\" \"Default\";\n";

TEST(DbcSaid, TheCounterThatTheDbcSaysIsTakenWhereTheMessageIsNew) {
  for (const std::string value : {"2", "\"MessageCounter\""}) {
    const std::string dbc = std::string(test::kSentDbc) + kKinds + "BA_ \"SigType\" SG_ 426 alive " + value + ";\n";
    const Import import = said_import({.signals = {"slope=Body.slope"}}, roomy_text(), dbc);
    ASSERT_TRUE(closing_of_slope(import).counter) << value;
    EXPECT_EQ(closing_of_slope(import).counter->field.start_bit, 48);
    EXPECT_EQ(import.frames.front(), "Body (0x1AA): counter alive");
    const ImportOptions other{.signals = {"slope=Body.slope"}, .counters = {"Body.crc"}};
    EXPECT_EQ(closing_of_slope(said_import(other, roomy_text(), dbc)).counter->field.start_bit, 56);
    const std::string without = said_import({.signals = {"slope=Body.slope"}}).text;
    EXPECT_EQ(said_import({.signals = {"slope=Body.slope"}}, without, dbc).text, without) << "it may be wrong";
  }
  EXPECT_FALSE(
      closing_of_slope(said_import({.signals = {"slope=Body.slope"}}, roomy_text(),
                                   std::string(test::kSentDbc) + kKinds + "BA_ \"SigType\" SG_ 426 alive 1;\n"))
          .counter);
}

TEST(DbcSaid, APeriodStandsInForTheOneThatTheDbcLacks) {
  const Import import = said_import({.signals = {"slope=Rare.slope"}, .periods = {"Rare=12.5"}});
  EXPECT_TRUE(says(import.text, "name = \"Rare\"\nid = 0x1F5\nbytes = 2\nperiod_ms = 12.5\n"));
  const Import two = said_import({.signals = {"slope=Mixed.slope", "arm_angle=Mixed.arm"}, .periods = {"Mixed=4"}});
  EXPECT_EQ(bus_of(two).broadcasts[0].period_s, 0.008) << "two frames in turn";
}

TEST(DbcSaid, WhatCannotBeIsRefusedInOneLine) {
  struct Case {
    ImportOptions said;
    const char* line;
  };
  const ImportOptions slope{.signals = {"slope=Body.slope"}};
  const auto with = [&](const std::vector<std::string>& counters, const std::vector<std::string>& periods = {}) {
    ImportOptions said = slope;
    said.counters = counters;
    said.periods = periods;
    return said;
  };
  const std::string there = said_import(slope).text;
  for (const Case& c : {
           Case{with({"Body"}), "--counter Body: must be such as MESSAGE.SIGNAL"},
           {with({"Body.alive="}), "--counter Body.alive=: must be such as MESSAGE.SIGNAL, or MESSAGE.SIGNAL=15"},
           {with({"Body.alive=17"}), "'bus.broadcast[0].counter.modulus' = 17: must be a whole number within [2, 16]"},
           {with({"Back.alive"}), "m.dbc: has no message 'Back'"},
           {with({"Body.count"}), "m.dbc:7: Body has no signal count; it has slope, boom, alive, crc"},
           {with({"Body.slope"}), "--counter Body.slope: is named as slope, too"},
           {with({"Body.alive", "Body.alive=15"}), "--counter Body.alive: is said twice"},
           {with({"Body.alive", "Body.crc"}), "--counter Body (counter): is said twice"},
           {with({"Alive.count"}), "--counter Alive.count: nothing else is taken of Alive: give its --signal"},
           {{.signals = {"slope=Mixed.slope"}, .counters = {"Mixed.own"}},
            "--counter Mixed.own: is not in every frame of its message"},
           {{.signals = {"slope=Mixed.slope"}, .counters = {"Mixed.which"}},
            "--counter Mixed.which: is the multiplexer"},
           {{.signals = {"slope=Body.slope"}, .constants = {"Body.alive=0"}, .counters = {"Body.alive"}},
            "--counter Body.alive: is said twice"},
           {{.signals = {"slope=Rare.slope"}},
            "m.dbc:29: Rare has no cycle time (GenMsgCycleTime): say how often it comes by --period Rare=MILLISECONDS"},
           {with({}, {"Rare"}), "--period Rare: must be such as MESSAGE=20, in ms within [1, 10000]"},
           {with({}, {"Rare=0"}), "--period Rare=0: must be such as"},
           {with({}, {"Rare=20000"}), "--period Rare=20000: must be such as"},
           {with({}, {"Back=20"}), "m.dbc: has no message 'Back'"},
           {with({}, {"Rare=20"}), "--period Rare: nothing is taken of it: give its --signal"},
           {with({}, {"Body=20", "Body=20"}), "--period Body: is said twice"},
           {with({}, {"Body=2000"}), "'bus.broadcast[0].period_ms' = 2000: must be within [1, 1000]"},
       }) {
    test::expect_refused([&] { return said_import(c.said); }, c.line);
  }
  EXPECT_EQ(test::refusal([&] { return said_import(with({}, {"Body=20"}), there); }),
            "--period Body: is in m.toml already: set its period_ms there");
  const std::string boom = said_import({.signals = {"boom_angle=Body.boom"}}).text;
  test::expect_refused([&] { return said_import({.counters = {"Body.boom"}}, boom); }, "has bits of boom_angle");
}

}  // namespace
}  // namespace knuckle::eds
