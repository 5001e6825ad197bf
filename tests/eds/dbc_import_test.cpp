// `knuckle bus import`: from a DBC to a machine file that is whole by itself.
#include "app/eds/dbc_import.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "app/eds/migrate.h"
#include "tests/eds/imports.h"
#include "tests/support/broadcast_machine.h"
#include "tests/support/few_nodes.h"

namespace knuckle::eds {
namespace {

using test::bus_of;
using test::replaced;
using test::roomy_text;
using test::says;

Import imported_into(const std::vector<std::string>& signals, const std::string& machine = roomy_text(),
                     const std::string& bus = "", const std::string& dbc = test::kSentDbc) {
  return test::imported({.signals = signals, .bus = bus}, dbc, machine);
}

const std::vector<std::string> kAngleSignals{"boom_angle=Front.boom", "arm_angle=Front.arm",
                                             "bucket_angle=Front.bucket"};

TEST(DbcImport, FramesTakeThePlaceOfTheNodesThatHadTheirSignals) {
  std::vector<std::string> wanted = kAngleSignals;
  wanted.emplace_back("slope=Body.slope");
  const Import import = imported_into(wanted);
  EXPECT_EQ(import.frames, (std::vector<std::string>{"Front (0x18FF1021): boom_angle, arm_angle, bucket_angle",
                                                     "Body (0x1AA): slope"}));
  EXPECT_EQ(import.gone_nodes, (std::vector<std::string>{"boom_encoder", "arm_encoder", "bucket_encoder", "tilt"}));
  EXPECT_EQ(import.to_do.size(), 5U) << "four angles, and the sender of a J1939 group";
  const BusDescription bus = bus_of(import);
  const auto [frame, bucket] = bus.broadcast(NodeRole::kEncoder, kBucket);
  EXPECT_TRUE(frame->filter().lets(0x0CFF1021U | kExtendedId)) << "a parameter group, whatever priority and sender";
  EXPECT_FALSE(frame->source);
  EXPECT_EQ(frame->period_s, 0.01);
  EXPECT_EQ(bucket->bits.order, BitField::Order::kBigEndian);
  EXPECT_EQ(bucket->bits.start_bit, 39);
  EXPECT_FALSE(bucket->invalid_from) << "signed";
  EXPECT_EQ(bus.broadcast(NodeRole::kEncoder, kBoom).field->invalid_from, 0xFB00U) << "J1939";
  EXPECT_EQ(bus.nodes.size(), 10U);
}

TEST(DbcImport, WhatPeopleAreToldComesFromJ1939Groups) {
  const Import import = imported_into({"engine_speed=Engine.turns"});
  EXPECT_TRUE(import.gone_nodes.empty());
  EXPECT_TRUE(says(import.text, "name = \"Engine\"\npgn = 0xF004\nbytes = 8\nperiod_ms = 100\n"));
  const BusDescription bus = bus_of(import);
  const auto [frame, speed] = bus.broadcast(NodeRole::kReading, 0);
  EXPECT_TRUE(frame->is_group());
  EXPECT_EQ(speed->invalid_from, 0xFB00U);
}

TEST(DbcImport, AllElseStaysAsItWas) {
  const std::string before = roomy_text(), after = imported_into({"slope=Body.slope"}).text;
  const auto node = before.find("[[bus.node]]\nname = \"tilt\""), next = before.find("[[bus.node]]\nname = \"enable\"");
  EXPECT_EQ(after.substr(0, node), before.substr(0, node));
  EXPECT_EQ(after.substr(after.find("\n[limits]")), before.substr(before.find("\n[limits]")));
  const std::string enable = before.substr(next, before.find("\n[limits]") - next);
  EXPECT_TRUE(says(after, enable));
}

TEST(DbcImport, AMultiplexedSignalIsOfTheFramesInWhichItsMultiplexerHasItsValue) {
  const Import import = imported_into({"slope=Mixed.slope", "arm_angle=Mixed.arm"});
  EXPECT_EQ(import.frames, (std::vector<std::string>{"Mixed_1 (0x1F4): slope", "Mixed_3 (0x1F4): arm_angle"}));
  const BusDescription bus = bus_of(import);
  const auto [frame, arm] = bus.broadcast(NodeRole::kEncoder, kArm);
  ASSERT_TRUE(frame->multiplexer);
  EXPECT_EQ(frame->multiplexer->value, 3U);
  EXPECT_EQ(frame->multiplexer->bits.bits, 8);
  EXPECT_EQ(frame->period_s, 0.01) << "two frames in turn, 5 ms each";
  EXPECT_EQ(arm->bits.start_bit, 8);
  EXPECT_EQ(std::count_if(import.to_do.begin(), import.to_do.end(),
                          [](const std::string& line) { return line.find("of its 2 frames in turn") != line.npos; }),
            2);
}

TEST(DbcImport, OneMoreSignalIsPutIntoTheFrameThatIsThereAlready) {
  std::string once = imported_into({"boom_angle=Front.boom"}).text;
  once = replaced(once, "period_ms = 10\n[bus.broadcast.signals]\n",
                  "period_ms = 8   # measured\ncounter = { start = 56, bits = 4 }\n[bus.broadcast.signals]\n");
  const std::string boom = "boom_angle = { start = 0, bits = 16, scale = 0.0004, offset = -10, unit = \"rad\"";
  once = replaced(once, boom + " }", boom + ", sign = -1, zero_rad = 0.12 }   # as mounted");
  const Import second = imported_into({"arm_angle=Front.arm"}, once);
  const std::string arm = "arm_angle = { start = 16, bits = 16, scale = 0.0004, offset = -10, unit = \"rad\" }\n";
  const auto node = second.text.find("name = \"arm_encoder\"");
  EXPECT_EQ(node, std::string::npos) << "its node is gone";
  EXPECT_TRUE(says(second.text, boom + ", sign = -1, zero_rad = 0.12 }   # as mounted\n" + arm));
  EXPECT_TRUE(says(second.text, "period_ms = 8   # measured\ncounter"));
  EXPECT_EQ(bus_of(second).broadcasts.size(), 1U);
}

TEST(DbcImport, ASignalThatWasWrongGetsTheDbcsBitsAndKeepsWhatAPersonSet) {
  std::string once = imported_into(kAngleSignals).text;
  once = replaced(once, "boom_angle = { start = 0, bits = 16, scale = 0.0004, offset = -10, unit = \"rad\" }",
                  "boom_angle = { start = 0, bits = 16, scale = 0.0004, offset = -10, unit = \"rad\", sign = -1, "
                  "zero_rad = 0.12, invalid_from = 0xF000 } # mine");
  const std::string dbc = replaced(test::kSentDbc, "boom : 0|16@1+ (0.0004,-10)", "boom : 48|16@1+ (0.0005,-16)");
  const Import again = imported_into({"boom_angle=Front.boom"}, once, "", dbc);
  EXPECT_EQ(again.text, replaced(once, "start = 0, bits = 16, scale = 0.0004, offset = -10, unit = \"rad\", sign",
                                 "start = 48, bits = 16, scale = 0.0005, offset = -16, unit = \"rad\", sign"));
  EXPECT_TRUE(again.to_do.empty()) << again.to_do.front();
}

TEST(DbcImport, ASignalThatAnotherFrameHadIsMovedWithWhatAPersonSet) {
  const std::string slope = "slope = { start = 0, bits = 16, type = \"signed\", scale = 0.01, unit = \"deg\"";
  const std::string once = replaced(imported_into({"slope=Body.slope"}, roomy_text()).text, slope + " }",
                                    slope + ", sign = -1, zero_rad = 0.02 }   # as mounted");
  const Import other = imported_into({"slope=Small.slope"}, once);
  const BusDescription bus = bus_of(other);
  EXPECT_EQ(bus.broadcast(NodeRole::kTilt, 0).frame->id, 0x21U | kExtendedId) << "29 bits, however small";
  EXPECT_EQ(bus.broadcast(NodeRole::kTilt, 0).field->bits.type, BitField::Type::kFloat);
  EXPECT_EQ(bus.broadcasts.size(), 1U) << "a frame without a signal is gone";
  EXPECT_EQ(other.frames, std::vector<std::string>{"Small (0x00000021): slope (moved from Body)"});
  EXPECT_EQ(other.gone_frames, std::vector<std::string>{"Body"});
  const std::string moved = ", unit = \"rad\", sign = -1, zero_rad = 0.02 }   # as mounted\n";
  EXPECT_TRUE(says(other.text, "bits = 32, type = \"float\", scale = 1" + moved));
  ASSERT_EQ(other.to_do.size(), 1U);
  EXPECT_TRUE(other.to_do.front().starts_with("Small: set invalid_from")) << "of the frame, not the signal";
}

TEST(DbcImport, SignalsOfTwoFramesAreExchanged) {
  const std::string one = "BO_ 426 Body: 8 Machine\n";
  const std::string dbc = replaced(
      replaced(test::kSentDbc, one, "BO_ 427 Other: 2 Machine\n SG_ angle : 0|16@1- (0.01,0) [0|0] \"deg\" X\n" + one),
      "BA_ \"GenMsgCycleTime\" BO_ 426 10;",
      "BA_ \"GenMsgCycleTime\" BO_ 426 10;\nBA_ \"GenMsgCycleTime\" BO_ 427 10;");
  const std::string wrong =
      imported_into({"arm_angle=Body.slope", "boom_angle=Other.angle"}, roomy_text(), "", dbc).text;
  const Import right = imported_into({"boom_angle=Body.slope", "arm_angle=Other.angle"}, wrong, "", dbc);
  const BusDescription bus = bus_of(right);
  EXPECT_EQ(bus.broadcast(NodeRole::kEncoder, kBoom).frame->id, 426U);
  EXPECT_EQ(bus.broadcast(NodeRole::kEncoder, kArm).frame->id, 427U);
  EXPECT_TRUE(right.gone_frames.empty());
}

TEST(DbcImport, OneMoreValueOfAMultiplexerHasWhatItsFramesHave) {
  std::string once = imported_into({"slope=Mixed.slope"}, roomy_text()).text;
  once = replaced(once, "[bus.broadcast.signals]",
                  "counter = { start = 60, bits = 4, modulus = 15 }\n[bus.broadcast.signals]");
  const BusDescription bus = bus_of(imported_into({"arm_angle=Mixed.arm"}, once));
  EXPECT_EQ(bus.broadcast(NodeRole::kEncoder, kArm).frame->closing, bus.broadcast(NodeRole::kTilt, 0).frame->closing);
  const std::string dbc =
      replaced(replaced(test::kSentDbc, "BO_ 500 Mixed", "BO_ 2566852881 Mixed"), "BA_ \"GenMsgCycleTime\" BO_ 500 5;",
               "BA_ \"GenMsgCycleTime\" BO_ 2566852881 5;\nBA_ \"VFrameFormat\" BO_ 2566852881 3;");
  std::string group = imported_into({"slope=Mixed.slope"}, roomy_text(), "", dbc).text;
  const auto pgn = group.find("pgn = "), end = group.find('\n', pgn);
  ASSERT_NE(pgn, std::string::npos);
  for (const std::string& completed :
       {group.substr(pgn, end - pgn) + "\nsource = 0x11", std::string("id = 0x18FF1111")}) {
    const std::string before = std::string(group).replace(pgn, end - pgn, completed);
    const BusDescription both = bus_of(imported_into({"arm_angle=Mixed.arm"}, before, "", dbc));
    const BroadcastFrame& arm = *both.broadcast(NodeRole::kEncoder, kArm).frame;
    EXPECT_EQ(arm.id, both.broadcast(NodeRole::kTilt, 0).frame->id);
    EXPECT_EQ(arm.source, both.broadcast(NodeRole::kTilt, 0).frame->source);
  }
}

TEST(DbcImport, MakesASecondBusOrTakesTheOneThatIsNamed) {
  const std::string before = roomy_text();
  const Import made = imported_into({"slope=Body.slope"}, before, "machine=250");
  const BusDescription bus = bus_of(made);
  ASSERT_TRUE(bus.second);
  EXPECT_EQ(bus.second->name, "machine");
  EXPECT_EQ(bus.second->bit_rate, 250000U);
  EXPECT_EQ(bus.name, "first");
  EXPECT_EQ(bus.broadcast(NodeRole::kTilt, 0).frame->id, 0x1AAU | kSecondBus);
  for (const auto& [name, on] : {std::pair{"machine", kSecondBus}, {"first", 0U}}) {
    const BusDescription both = bus_of(imported_into(kAngleSignals, made.text, name));
    EXPECT_EQ(both.broadcast(NodeRole::kEncoder, kArm).frame->id & kSecondBus, on) << name;
  }
  struct Case {
    std::string machine, bus;
    const char* said;
  };
  for (const Case& c : {Case{made.text, "", "--bus: is required: m.toml has two buses, first, machine"},
                        {made.text, "third=250", "--bus third: must be one of first, machine"},
                        {made.text, "machine=250", "m.toml has that bus: give its name alone"},
                        {before, "machine", "for a second one give its bit rate in kbit/s, such as machine=250"},
                        {before, "machine=fast", "--bus machine=fast: must be such as machine, or machine=250"}}) {
    test::expect_refused([&] { return imported_into({"slope=Body.slope"}, c.machine, c.bus); }, c.said);
  }
}

TEST(DbcImport, KeepsLineEndsAndRefusesHeadersThatItDoesNotFind) {
  const std::string after = imported_into({"slope=Body.slope"}, test::with_crlf(roomy_text())).text;
  EXPECT_EQ(after, test::with_crlf(imported_into({"slope=Body.slope"}).text));
  const std::string commented =
      replaced(roomy_text(), "[[bus.node]]\nname = \"tilt\"", "[[bus.node]] # [old]\nname = \"tilt\"");
  EXPECT_EQ(bus_of(imported_into({"slope=Body.slope"}, commented)).nodes.size(), 13U);
  for (const char* const header : {"[[bus.node]]", "[limits]"}) {
    const std::string indented = replaced(roomy_text(), header, std::string("  ") + header);
    test::expect_refused([&] { return imported_into({"slope=Body.slope"}, indented); },
                         std::string("headers must each begin a line: ") + header);
  }
}

TEST(DbcImport, OfAnOlderFileMakesTheNodesTablesFirst) {
  EXPECT_EQ(imported_into({"slope=Body.slope"}, test::with_keyed_nodes(roomy_text())).text,
            imported_into({"slope=Body.slope"}, with_node_tables(test::with_keyed_nodes(roomy_text()), "m.toml")).text);
}

TEST(DbcImport, ANodeIsGoneWithItsTables) {
  std::string before = replaced(roomy_text(), "channels = { 1 = \"slope\" }\n", "");
  before.insert(before.find("\n[[bus.node]]\nname = \"enable\""), "[bus.node.channels]\n1 = \"slope\"\n");
  ASSERT_EQ(parse_machine(before, "m.toml").bus, parse_machine(roomy_text(), "m.toml").bus);
  EXPECT_EQ(imported_into({"slope=Body.slope"}, before).text, imported_into({"slope=Body.slope"}).text);
}

TEST(DbcImport, WhatCannotBeReadIsRefusedInOneLine) {
  struct Case {
    std::vector<std::string> wanted;
    const char* said;
  };
  for (const Case& c :
       {Case{{"boom_angle"}, "--signal boom_angle: must be such as boom_angle=MESSAGE.SIGNAL"},
        {{"boom=Front.boom"}, "--signal boom: must be one of boom_head_pressure, "},
        {{"boom_spool=Front.boom"}, "--signal boom_spool: must be one of"},
        {{"boom_extend_pilot=Front:shut=0.6,full=2"}, "must be such as boom_angle=MESSAGE.SIGNAL"},
        {{"boom_angle=Front.boom:"}, "must be such as boom_angle=MESSAGE.SIGNAL"},
        {{"boom_angle=Front.boom:shut=0.6,full=2"}, "--signal boom_angle: is no pilot pressure"},
        {{"boom_extend_pilot=Front.boom:shut=0.6"}, "--signal shut=0.6: must be such as shut=0.6,full=2.8"},
        {{"slope=Front.slope"}, "m.dbc:3: Front has no signal slope; it has boom, arm, bucket"},
        {{"slope=Back.slope"}, "m.dbc"},
        {{"slope=Nested.deep"}, "is multiplexed by inner, which is multiplexed itself"},
        {{"slope=Nested.wide"}, "comes with several values of outer: a machine file takes it with one alone"},
        {{"slope=Mixed.slope", "boom_angle=Mixed.turn"},
         "of Mixed signal turn is in every frame, and slope only with one value of a multiplexer"},
        {{"slope=Mixed.pace"}, "has the unit \"furlong\": must be rad, deg"},
        {{"slope=Rare.slope"}, "m.dbc:29: Rare has no cycle time (GenMsgCycleTime)"},
        {{"slope=Body.slope", "slope=Small.slope"}, "--signal slope: is wanted twice"},
        {{"boom_head_pressure=Front.boom"}, "has the unit \"rad\": must be "},
        {{"boom_length=Front.boom"}, "has the unit \"rad\": must be mm, m"}}) {
    test::expect_refused([&] { return imported_into(c.wanted); }, c.said);
  }
  const std::string pressure = replaced(test::kSentDbc, "[-10|10] \"rad\"", "[-10|10] \"bar\"");
  test::expect_refused(
      [&] { return imported_into({"boom_head_pressure=Front.boom"}, test::few_nodes_text(), "", pressure); },
      "node 'pressures' also has ");
}

}  // namespace
}  // namespace knuckle::eds
