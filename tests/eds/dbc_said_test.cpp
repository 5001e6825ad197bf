// `knuckle bus import`: what a person says of messages beside their signals, where a DBC does not: counters, periods.
#include <gtest/gtest.h>

#include "app/eds/dbc_import.h"
#include "machine/file_text.h"
#include "machine/load.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"

namespace knuckle::eds {
namespace {

constexpr const char* kSaidDbc = R"(VERSION ""
BU_: Machine Knuckle
BO_ 426 Body: 8 Machine
 SG_ pitch : 0|16@1- (0.01,0) [-90|90] "deg" Knuckle
 SG_ boom : 16|16@1+ (0.0004,-10) [0|0] "rad" Knuckle
 SG_ alive : 48|4@1+ (1,0) [0|14] "" Knuckle
 SG_ crc : 56|8@1+ (1,0) [0|255] "" Knuckle
BO_ 500 Mixed: 8 Machine
 SG_ which M : 0|8@1+ (1,0) [0|0] "" Knuckle
 SG_ pitch m1 : 8|16@1- (0.01,0) [0|0] "deg" Knuckle
 SG_ arm m3 : 8|16@1+ (0.0004,-10) [0|0] "rad" Knuckle
 SG_ own m1 : 48|8@1+ (1,0) [0|0] "" Knuckle
 SG_ alive : 56|8@1+ (1,0) [0|0] "" Knuckle
BO_ 501 Rare: 2 Machine
 SG_ pitch : 0|16@1- (0.01,0) [0|0] "deg" Knuckle
BO_ 502 Alive: 1 Machine
 SG_ count : 0|8@1+ (1,0) [0|0] "" Knuckle
BA_DEF_ BO_ "GenMsgCycleTime" INT 0 60000;
BA_DEF_DEF_ "GenMsgCycleTime" 0;
BA_ "GenMsgCycleTime" BO_ 426 10;
BA_ "GenMsgCycleTime" BO_ 500 5;
BA_ "GenMsgCycleTime" BO_ 502 10;
)";

struct Said {
  std::vector<std::string> signals{}, counters{}, checksums{}, periods{}, constants{};
};

/// On its bus for a frame more.
std::string roomy_text() {
  std::string text = whole_file(test::source_dir() + "/config/machines/solar015.toml", 1);
  const std::string from = "\nvalve_status_every_nth_sync = 4";
  return text.replace(text.find(from), from.size(), "\nvalve_status_every_nth_sync = 8");
}

Import said_import(const Said& said, const std::string& machine = roomy_text(), const std::string& dbc = kSaidDbc) {
  std::vector<WantedSignal> signals;
  WantedFrames wanted;
  for (const std::string& one : said.signals) signals.push_back(wanted_signal(one));
  for (const std::string& one : said.counters) wanted.counters.push_back(wanted_counter(one));
  for (const std::string& one : said.checksums) wanted.checksums.push_back(wanted_checksum(one));
  for (const std::string& one : said.periods) wanted.periods.push_back(wanted_period(one));
  for (const std::string& one : said.constants) wanted.constants.push_back(wanted_constant(one));
  return with_frames(machine, "m.toml", parse_dbc(dbc, "m.dbc"), signals, wanted);
}

FrameClosing closing_of_slope(const Import& import) {
  return parse_machine(import.text, "m.toml").bus.broadcast(NodeRole::kTilt, 0).frame->closing;
}

std::string replaced_once(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(DbcSaid, CounterAndChecksumOfWhatTheMachineSendsAreSaidAsThoseOfCommands) {
  const Import import = said_import(
      {.signals = {"slope=Body.pitch"}, .counters = {"Body.alive=15"}, .checksums = {"Body.crc=crc8-j1850"}});
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
  const std::string before = said_import({.signals = {"slope=Body.pitch"}}).text;
  const Import all = said_import({.counters = {"Body.alive"}}, before);
  EXPECT_EQ(closing_of_slope(all).counter->modulus, 0U) << "all that its bits can count";
  const std::string by_hand = replaced_once(all.text, "bits = 4 }", "bits = 4, modulus = 15 }   # it does");
  EXPECT_EQ(said_import({.counters = {"Body.alive"}}, by_hand).text, by_hand);
  EXPECT_EQ(said_import({.counters = {"Body.alive=14"}}, by_hand).text,
            replaced_once(by_hand, "modulus = 15", "modulus = 14"));
}

TEST(DbcSaid, FramesUnderOneIdentifierHaveOneCounter) {
  const Said one{.signals = {"slope=Mixed.pitch"}, .counters = {"Mixed.alive"}},
      other{.signals = {"arm_angle=Mixed.arm"}},
      both{.signals = {"slope=Mixed.pitch", "arm_angle=Mixed.arm"}, .counters = {"Mixed.alive"}};
  for (const Import& import : {said_import(both), said_import(other, said_import(one).text),
                               said_import(both, said_import(other).text), said_import(both, said_import(one).text)}) {
    const BusDescription bus = parse_machine(import.text, "m.toml").bus;
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
    const std::string dbc = std::string(kSaidDbc) + kKinds + "BA_ \"SigType\" SG_ 426 alive " + value + ";\n";
    const Import import = said_import({.signals = {"slope=Body.pitch"}}, roomy_text(), dbc);
    ASSERT_TRUE(closing_of_slope(import).counter) << value;
    EXPECT_EQ(closing_of_slope(import).counter->field.start_bit, 48);
    EXPECT_EQ(import.frames.front(), "Body (0x1AA): counter alive");
    const Said other{.signals = {"slope=Body.pitch"}, .counters = {"Body.crc"}};
    EXPECT_EQ(closing_of_slope(said_import(other, roomy_text(), dbc)).counter->field.start_bit, 56);
    const std::string without = said_import({.signals = {"slope=Body.pitch"}}).text;
    EXPECT_EQ(said_import({.signals = {"slope=Body.pitch"}}, without, dbc).text, without) << "it may be wrong";
  }
  EXPECT_FALSE(closing_of_slope(said_import({.signals = {"slope=Body.pitch"}}, roomy_text(),
                                            std::string(kSaidDbc) + kKinds + "BA_ \"SigType\" SG_ 426 alive 1;\n"))
                   .counter);
}

TEST(DbcSaid, APeriodStandsInForTheOneThatTheDbcLacks) {
  const Import import = said_import({.signals = {"slope=Rare.pitch"}, .periods = {"Rare=12.5"}});
  EXPECT_NE(import.text.find("name = \"Rare\"\nid = 0x1F5\nbytes = 2\nperiod_ms = 12.5\n"), std::string::npos)
      << import.text;
  const Import two = said_import({.signals = {"slope=Mixed.pitch", "arm_angle=Mixed.arm"}, .periods = {"Mixed=4"}});
  EXPECT_EQ(parse_machine(two.text, "m.toml").bus.broadcasts[0].period_s, 0.008) << "two frames in turn";
}

TEST(DbcSaid, WhatCannotBeIsRefusedInOneLine) {
  struct Case {
    Said said;
    const char* line;
  };
  const Said slope{.signals = {"slope=Body.pitch"}};
  const auto with = [&](const std::vector<std::string>& counters, const std::vector<std::string>& periods = {}) {
    Said said = slope;
    said.counters = counters;
    said.periods = periods;
    return said;
  };
  const std::string there = said_import(slope).text;
  for (const Case& c : {
           Case{with({"Body"}), "--counter Body: must be such as MESSAGE.SIGNAL"},
           {with({"Body.alive="}), "--counter Body.alive=: must be such as MESSAGE.SIGNAL, or MESSAGE.SIGNAL=15"},
           {with({"Body.alive=-1"}), "--counter Body.alive=-1: must be such as"},
           {with({"Body.alive=17"}), "'bus.broadcast[0].counter.modulus' = 17: must be a whole number within [2, 16]"},
           {with({"Body.alive=1"}), "'bus.broadcast[0].counter.modulus' = 1: must be a whole number within [2, 16]"},
           {with({"Back.alive"}), "m.dbc: has no message 'Back'"},
           {with({"Body.count"}), "m.dbc:3: Body has no signal count; it has pitch, boom, alive, crc"},
           {with({"Body.pitch"}), "--counter Body.pitch: is named as slope, too"},
           {with({"Body.alive", "Body.alive=15"}), "--counter Body.alive: is said twice"},
           {with({"Body.alive", "Body.crc"}), "--counter Body (counter): is said twice"},
           {with({"Alive.count"}), "--counter Alive.count: nothing else is taken of Alive: give its --signal"},
           {{.signals = {"slope=Mixed.pitch"}, .counters = {"Mixed.own"}},
            "--counter Mixed.own: is not in every frame of its message"},
           {{.signals = {"slope=Mixed.pitch"}, .counters = {"Mixed.which"}},
            "--counter Mixed.which: is the multiplexer"},
           {{.signals = {"slope=Body.pitch"}, .counters = {"Body.alive"}, .constants = {"Body.alive=0"}},
            "--counter Body.alive: is said twice"},
           {{.signals = {"slope=Rare.pitch"}},
            "m.dbc:14: Rare has no cycle time (GenMsgCycleTime): say how often it comes by --period Rare=MILLISECONDS"},
           {with({}, {"Rare"}), "--period Rare: must be such as MESSAGE=20, in ms within [1, 10000]"},
           {with({}, {"Rare=fast"}), "--period Rare=fast: must be such as"},
           {with({}, {"Rare=0"}), "--period Rare=0: must be such as"},
           {with({}, {"Rare=20000"}), "--period Rare=20000: must be such as"},
           {with({}, {"Rare=nan"}), "--period Rare=nan: must be such as"},
           {with({}, {"=20"}), "--period =20: must be such as"},
           {with({}, {"Back=20"}), "m.dbc: has no message 'Back'"},
           {with({}, {"Rare=20"}), "--period Rare: nothing is taken of it: give its --signal"},
           {with({}, {"Body=20", "Body=20"}), "--period Body: is said twice"},
           {with({}, {"Body=2000"}), "'bus.broadcast[0].period_ms' = 2000: must be within [1, 1000]"},
       }) {
    const std::string line = test::refusal([&] { (void)said_import(c.said); });
    EXPECT_NE(line.find(c.line), std::string::npos) << line;
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  }
  EXPECT_EQ(test::refusal([&] { (void)said_import(with({}, {"Body=20"}), there); }),
            "--period Body: is in m.toml already: set its period_ms there");
  const std::string boom = said_import({.signals = {"boom_angle=Body.boom"}}).text;
  EXPECT_NE(test::refusal([&] { (void)said_import({.counters = {"Body.boom"}}, boom); }).find("has bits of boom_angle"),
            std::string::npos);
}

}  // namespace
}  // namespace knuckle::eds
