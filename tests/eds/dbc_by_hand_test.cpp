// `knuckle bus import`: what a person says or set by hand wins over what a DBC says, and nothing of it goes silently.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

#include "tests/eds/imports.h"
#include "tests/support/j1939_machine.h"

namespace knuckle::eds {
namespace {

using test::bus_of;
using test::has_line;
using test::replaced;
using test::says;

/// Beside standard200.dbc: what else could tell it, what else it could send, and what signals are (SigType).
constexpr const char* kMoreDbc = R"(
BO_ 2566849797 Speeds: 8 Remote
 SG_ boom_speed : 0|16@1- (0.001,0) [0|0] "rad/s" Machine
 SG_ arm_speed : 16|16@1- (0.001,0) [0|0] "rad/s" Machine
 SG_ bucket_speed : 32|16@1- (0.001,0) [0|0] "rad/s" Machine
 SG_ alive : 48|4@1+ (1,0) [0|0] "" Machine
 SG_ nibble : 52|4@1+ (1,0) [0|0] "" Machine
 SG_ crc : 56|8@1+ (1,0) [0|0] "" Machine
BO_ 2566870000 Angle: 8 Machine
 SG_ boom : 0|16@1+ (0.0004,-10) [0|0] "rad" Remote
 SG_ alive : 48|4@1+ (1,0) [0|0] "" Remote
 SG_ nibble : 52|4@1+ (1,0) [0|0] "" Remote
 SG_ crc : 56|8@1+ (1,0) [0|0] "" Remote
BO_ 2583650558 Coolant: 20 Engine
 SG_ level : 134|8@1+ (0.4,0) [0|100] "%" Remote
 SG_ alive : 144|8@1+ (1,0) [0|0] "" Remote
BA_ "GenMsgCycleTime" BO_ 2566849797 10;
BA_ "GenMsgCycleTime" BO_ 2566870000 10;
BA_ "GenMsgCycleTime" BO_ 2583650558 1000;
BA_ "VFrameFormat" BO_ 2583650558 3;
BA_DEF_ SG_ "SigType" ENUM "Default","Range","MessageCounter","MessageChecksum";
)";
constexpr const char* kBoomBySpeeds = "boom=Speeds.boom_speed:extend=0.37,retract=-0.37";

const ImportOptions kAllBySpeeds{.commands = {kBoomBySpeeds, "arm=Speeds.arm_speed:extend=-0.6,retract=0.6",
                                              "bucket=Speeds.bucket_speed:extend=-1,retract=1"},
                                 .constants = {"Speeds=0"}};

std::string of_standard200(const std::string& extension) {
  return test::content(test::source_dir() + "/config/machines/standard200." + extension);
}

/// @param kinds such as "2566849797 alive 2": what signals are
std::string dbc_with(const std::vector<std::string>& kinds = {}) {
  std::string dbc = of_standard200("dbc") + kMoreDbc;
  for (const std::string& kind : kinds) dbc += "BA_ \"SigType\" SG_ " + kind + ";\n";
  return dbc;
}

Import by_hand(const ImportOptions& said, const std::string& dbc = dbc_with(),
               const std::string& machine = of_standard200("toml")) {
  return test::imported(said, dbc, machine);
}

const CommandFrame& command_of(const BusDescription& bus, const std::string& name) {
  const auto found = std::find_if(bus.commands.begin(), bus.commands.end(),
                                  [&](const CommandFrame& frame) { return frame.name == name; });
  if (found == bus.commands.end()) throw std::runtime_error("no command " + name);
  return *found;
}
FrameClosing closing_of(const Import& import, const std::string& frame) {
  const BusDescription bus = bus_of(import);
  for (const BroadcastFrame& one : bus.broadcasts)
    if (one.name == frame) return one.closing;
  return command_of(bus, frame).closing;
}

TEST(DbcByHand, AJointThatComesFromTwoMessagesIsRefused) {
  const std::string rates = "boom=front_rate.boom_rate:extend=0.37,retract=-0.37";
  test::expect_refused(
      [&] {
        return wanted_of({.commands = {kBoomBySpeeds, rates}, .constants = {"Speeds=0"}});
      },
      "--command boom: is in Speeds and in front_rate: one message alone must move a joint");
  EXPECT_NO_THROW((void)wanted_of({.commands = {"boom=aux.up:extend=100", "boom=aux.down:retract=100"}}))
      << "of one message";
}

TEST(DbcByHand, AChecksumIsNoCounterWhateverTheDbcSays) {
  for (const std::string signal : {"crc", "alive"}) {
    const FrameClosing told = closing_of(
        by_hand({.commands = {kBoomBySpeeds}, .constants = {"Speeds=0"}, .checksums = {"Speeds." + signal + "=xor"}},
                dbc_with({"2566849797 " + signal + " 2"})),
        "Speeds");
    const FrameClosing sent =
        closing_of(by_hand({.signals = {"boom_angle=Angle.boom"}, .checksums = {"Angle." + signal + "=xor"}},
                           dbc_with({"2566870000 " + signal + " 2"})),
                   "Angle");
    for (const FrameClosing& closing : {told, sent}) {
      ASSERT_TRUE(closing.checksum) << signal;
      EXPECT_EQ(closing.checksum->kind, FrameChecksum::Kind::kXor);
      EXPECT_FALSE(closing.counter);
    }
  }
}

TEST(DbcByHand, AConstantThatBecomesAJointKeepsItsNeutral) {
  std::string machine = of_standard200("toml"), dbc = dbc_with();
  for (int n = 0; n < 4; ++n) dbc = replaced(dbc, "(0.0005,-16) [0|0] \"rad/s\"", "(0.01,0) [0|0] \"%\"");
  for (const auto& [old, is] : {std::pair{"neutral = 0, extend = 0.37, retract = -0.37", "100, retract = 0"},
                                {"neutral = 0, extend = -0.6, retract = 0.6", "0, retract = 100"},
                                {"neutral = 0, extend = -1.0, retract = 1.0", "0, retract = 100"}}) {
    machine = replaced(machine, old, std::string("neutral = 50, extend = ") + is);
    machine = replaced(machine, "scale = 0.0005, offset = -16, unit = \"rad/s\"", "scale = 0.01, unit = \"%\"");
  }
  machine = replaced(machine, "scale = 0.0005, offset = -16, neutral = 0 }", "scale = 0.01, neutral = 50 }");
  machine = replaced(machine, "[[bus.broadcast]]", R"([[bus.command]]
name = "aux"
id = 0x18FF0605
bytes = 8
period_ms = 10
send = "always"
[bus.command.fields]
up = { start = 0, bits = 16, scale = 0.01, neutral = 20 }   # stands open a bit

[[bus.broadcast]])");
  dbc += R"(BO_ 2566850053 aux: 8 Remote
 SG_ up : 0|16@1+ (0.01,0) [0|0] "%" Machine
 SG_ down : 16|16@1+ (0.01,0) [0|0] "%" Machine
BA_ "GenMsgCycleTime" BO_ 2566850053 10;
)";
  const Import import = by_hand({.commands = {"boom=aux.up:extend=100", "boom=aux.down:retract=100"}}, dbc, machine);
  EXPECT_TRUE(says(import.text,
                   "up = { start = 0, bits = 16, scale = 0.01, unit = \"%\", joint = \"boom\", neutral = 20, "
                   "extend = 100 }   # stands open a bit\n"));
  EXPECT_TRUE(has_line(import.to_do, "up in aux: its neutral stays: set it where that moves the boom"));
  EXPECT_TRUE(has_line(import.to_do, "down in aux: its neutral is 0: set it where that moves the boom"));
}

TEST(DbcByHand, WhichWayAFieldWentGetsANameOfItsOwn) {
  const std::string
      boom =
          "boom_rate = { start = 0, bits = 16, scale = 0.0005, offset = -16, unit = \"rad/s\", joint = "
          "\"boom\", neutral = 0, extend = 0.37, retract = -0.37 }\n",
      arm =
          "arm_rate = { start = 16, bits = 16, scale = 0.0005, offset = -16, unit = \"rad/s\", joint = "
          "\"arm\", neutral = 0, extend = -0.6, retract = 0.6 }\n",
      slew = "slew_rate = { start = 48, bits = 16, scale = 0.0005, offset = -16, neutral = 0 }   # not used\n";
  const auto with_way = [](std::string line, int start) {
    line = replaced(line, "\", neutral",
                    fmt::format("\", direction = {{ start = {}, bits = 4, neutral = 3, extend = 1, "
                                "retract = 2 }}, neutral",
                                start));
    return replaced(line, " = -0.", " = 0.");
  };
  const ImportOptions both{.commands = {kBoomBySpeeds, "arm=Speeds.arm_speed:extend=-0.6,retract=0.6"},
                           .constants = {"Speeds=0"}};
  const auto at = [](const Import& import, int start) {
    const BusDescription bus = bus_of(import);
    for (const CommandField& field : command_of(bus, "front_rate").fields)
      if (field.bits.start_bit == start) return field.neutral;
    return -1.0;
  };
  std::string machine = replaced(of_standard200("toml"), boom, with_way(boom, 48));
  machine = replaced(machine, slew, "boom_rate_way = { start = 56, bits = 4, neutral = 5 }\n");
  const Import taken = by_hand(both, dbc_with(), machine);
  EXPECT_EQ(at(taken, 48), 3);
  EXPECT_EQ(at(taken, 56), 5);
  const std::string name = "a_very_long_name_of_a_field_xxx";
  machine = replaced(of_standard200("toml"), boom, replaced(with_way(boom, 48), "boom_rate", name + "1"));
  machine = replaced(replaced(machine, arm, replaced(with_way(arm, 52), "arm_rate", name + "2")), slew, "");
  const Import alike = by_hand(both, dbc_with(), machine);
  EXPECT_EQ(at(alike, 48), 3);
  EXPECT_EQ(at(alike, 52), 3);
}

TEST(DbcByHand, AJointThatAnotherMessageCommandsRestsInItsOldFrame) {
  const std::string line = "boom_rate = { start = 0, bits = 16, scale = 0.0005, offset = -16, ",
                    speeds = "neutral = 0, extend = 0.37, retract = -0.37 }";
  const Import import = by_hand({.commands = {kBoomBySpeeds}, .constants = {"Speeds=0"}}, dbc_with(),
                                replaced(of_standard200("toml"), speeds, speeds + " # fast"));
  const BusDescription bus = bus_of(import);
  ASSERT_EQ(bus.commands.size(), 3U);
  EXPECT_EQ(bus.command(kBoom, true)->name, "boom_speed");
  EXPECT_TRUE(says(import.text, line + "neutral = 0 } # fast\n"))
      << "in no field it would be sent as raw 0, 16 rad/s backwards";
  EXPECT_EQ(import.at_rest, std::vector<std::string>{"boom_rate in front_rate"});
  EXPECT_TRUE(import.gone_frames.empty());
}

TEST(DbcByHand, AFrameThatMovesNoJointAnyMoreGoesWithItsConstants) {
  const std::string next = "[[bus.command]]\nname = \"machine_setting\"", noted = "# of another frame\n" + next,
                    before = replaced(of_standard200("toml"), next, noted);
  const Import import = by_hand(kAllBySpeeds, dbc_with(), before);
  const BusDescription bus = bus_of(import), was = parse_machine(before, "m.toml").bus;
  ASSERT_EQ(bus.commands.size(), 2U);
  EXPECT_EQ(bus.commands[0], was.commands[1]);
  EXPECT_EQ(bus.commands[1].name, "Speeds");
  EXPECT_EQ(import.gone_frames, std::vector<std::string>{"front_rate (with its constant slew_rate)"});
  EXPECT_TRUE(import.at_rest.empty());
  EXPECT_TRUE(says(import.text, noted));
  EXPECT_FALSE(says(import.text, "\n\n\n")) << "no gap";
  EXPECT_EQ(by_hand(kAllBySpeeds, dbc_with(), import.text).text, import.text) << "once more changes nothing";
  ImportOptions named = kAllBySpeeds;
  named.constants.emplace_back("front_rate.slew_rate=0");
  EXPECT_EQ(bus_of(by_hand(named, dbc_with(), before)).commands.size(), 3U) << "unless it is named";
}

TEST(DbcByHand, AValveThatWasToldInShortGoes) {
  const std::string dbc = test::all_changed(dbc_with(), " 2566849797", " 2566849830");  // the valves' address
  const Import import = by_hand(kAllBySpeeds, dbc, test::valves_text());
  const BusDescription bus = bus_of(import);
  ASSERT_EQ(bus.commands.size(), 1U);
  EXPECT_EQ(bus.commands[0].name, "Speeds");
  EXPECT_EQ(import.gone_frames.size(), 3U);
}

TEST(DbcByHand, AFrameWithConstantsThatTheDbcDoesNotSayStays) {
  const std::string unknown = replaced(of_standard200("toml"), "id = 0x18FF0105", "id = 0x18FF0995"),
                    damaged = replaced(dbc_with(), "arm_rate : 16|16", "arm_rate : 8|16"),
                    slew = " SG_ slew_rate : 48|16@1+ (0.0005,-16) [0|0] \"rad/s\" Machine\n",
                    narrow = replaced(dbc_with(), slew, "");
  for (const Import& import :
       {by_hand(kAllBySpeeds, dbc_with(), unknown), by_hand(kAllBySpeeds, damaged), by_hand(kAllBySpeeds, narrow)}) {
    const BusDescription bus = bus_of(import);
    EXPECT_EQ(bus.commands.size(), 3U);
    EXPECT_EQ(command_of(bus, "front_rate").fields.size(), 4U);
    EXPECT_TRUE(import.gone_frames.empty());
    EXPECT_EQ(import.at_rest.size(), 3U);
    EXPECT_TRUE(has_line(import.to_do,
                         "front_rate: moves no joint any more, but has slew_rate, which m.dbc has not: take it out "
                         "where nothing needs it"));
  }
}

TEST(DbcByHand, ACounterThatCannotBeOneIsLeftOutAndNamed) {
  const std::string left_out = ": is a counter (SigType) of a kind that Knuckle does not know: left out";
  const Import packets = by_hand({.signals = {"fuel_level=Coolant.level"}}, dbc_with({"2583650558 alive 2"}));
  EXPECT_TRUE(has_line(packets.to_do, "Coolant.alive" + left_out));
  const Import multiplexer = by_hand({.signals = {"fuel_level=service.fuel"}}, dbc_with({"2566869025 item 2"}));
  EXPECT_TRUE(has_line(multiplexer.to_do, "service.item" + left_out));
  const Import multiplexed = by_hand({.signals = {"fuel_level=service.fuel"}}, dbc_with({"2566869025 hours 2"}));
  EXPECT_TRUE(has_line(multiplexed.to_do, "service.hours" + left_out));
  const std::string wide = replaced(dbc_with({"2566870000 alive 2"}), "alive : 48|4@1+ (1,0) [0|0] \"\" Remote",
                                    "alive : 16|33@1+ (1,0) [0|0] \"\" Remote");
  EXPECT_TRUE(has_line(by_hand({.signals = {"boom_angle=Angle.boom"}}, wide).to_do, "Angle.alive" + left_out));
  const std::string dbc = dbc_with({"2566849797 alive 2"});
  for (const std::string& other :
       {replaced(dbc, "alive : 48|4@1+ (1,0) [0|0] \"\" M", "alive : 48|4@1- (1,0) [0|0] \"\" M"),
        dbc_with({"2566849797 bucket_speed 2"})}) {
    const Import import = by_hand({.commands = {kBoomBySpeeds}, .constants = {"Speeds=0"}}, other);
    EXPECT_FALSE(closing_of(import, "Speeds").counter);
    EXPECT_EQ(std::count_if(import.to_do.begin(), import.to_do.end(),
                            [&](const std::string& line) { return line.ends_with(left_out); }),
              1);
  }
}

TEST(DbcByHand, AChecksumThatTheDbcSaysIsNoConstantUnlessAPersonSaysSo) {
  const std::string dbc = dbc_with({"2566849797 crc 3"});
  ImportOptions said{.commands = {kBoomBySpeeds}, .constants = {"Speeds=0"}};
  test::expect_refused([&] { return by_hand(said, dbc); },
                       "signal crc of Speeds is its checksum (SigType): say which by --checksum Speeds.crc=KIND, or "
                       "--constant Speeds.crc=VALUE where nothing checks it");
  said.checksums = {"Speeds.crc=crc8-j1850"};
  EXPECT_TRUE(closing_of(by_hand(said, dbc), "Speeds").checksum);
  EXPECT_FALSE(
      closing_of(by_hand({.commands = {kBoomBySpeeds}, .constants = {"Speeds=0", "Speeds.crc=0"}}, dbc), "Speeds")
          .checksum);
}

TEST(DbcByHand, ACounterCountsAsFarAsItsRange) {
  const auto modulus_with = [](const std::string& range) {
    const std::string dbc = replaced(dbc_with({"2566870000 alive 2"}), "alive : 48|4@1+ (1,0) [0|0] \"\" Remote",
                                     "alive : 48|4@1+ (1,0) " + range + " \"\" Remote");
    return closing_of(by_hand({.signals = {"boom_angle=Angle.boom"}}, dbc), "Angle").counter.value().modulus;
  };
  EXPECT_EQ(modulus_with("[0|14]"), 15U);
  for (const char* const whole : {"[0|15]", "[0|0]", "[0|200]", "[1|14]", "[0|7.5]"})
    EXPECT_EQ(modulus_with(whole), 0U) << whole;
}

TEST(DbcByHand, OfTwoCountersThePersonSaysWhich) {
  const std::string dbc = dbc_with({"2566870000 alive 2", "2566870000 nibble 2"});
  const ImportOptions angle{.signals = {"boom_angle=Angle.boom"}};
  test::expect_refused([&] { return by_hand(angle, dbc); },
                       "Angle has two counters (SigType), alive and nibble: say which by --counter Angle.alive");
  const Import said = by_hand({.signals = angle.signals, .counters = {"Angle.nibble"}}, dbc);
  EXPECT_EQ(closing_of(said, "Angle").counter->field.start_bit, 52);
}

TEST(DbcByHand, WhatACounterOrAChecksumReplacesIsNamed) {
  const Import told = by_hand({.counters = {"machine_setting.horn"}});
  EXPECT_EQ(told.frames, std::vector<std::string>{"machine_setting (0x18FF0205); counter horn (was start = 48, bits = "
                                                  "8), no constant any more: horn, in the table that was there"});
  const std::string before =
      by_hand({.signals = {"boom_angle=Angle.boom"}, .counters = {"Angle.alive"}, .checksums = {"Angle.crc=sum"}}).text;
  const Import sent = by_hand({.counters = {"Angle.nibble"}, .checksums = {"Angle.crc=xor"}}, dbc_with(), before);
  EXPECT_EQ(sent.frames,
            std::vector<std::string>{"Angle (0x18FF53F0): counter nibble (was start = 48, bits = 4), checksum crc"});
}

}  // namespace
}  // namespace knuckle::eds
