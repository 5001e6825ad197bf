// A bus as DBC files describe it: what they say, the slips of files in the field, and what makes a message unusable.
#include "app/eds/dbc_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "tests/eds/machine_texts.h"
#include "tests/support/refusal.h"

namespace knuckle::eds {
namespace {

using test::all_changed;
using test::replaced;
using test::says;
using Type = BitField::Type;
using Order = BitField::Order;

const std::string kExcavator = test::source_dir() + "/tests/eds/excavator.dbc";

/// Two messages and their signals, in lines 1 to 4.
const std::string kTwoMessages =
    "BO_ 256 A: 8 Maker\n SG_ a : 0|16@1+ (0.5,-8) [0|0] \"bar\" Other\n"
    " SG_ b : 23|8@0- (1,0) [-5|5] \"\" Other,Third\nBO_ 2147483904 B: 2 Vector__XXX\n";

/// A signal's line. @param name with its mark, @param bits "0|8@1+"
std::string sg(const std::string& name, const std::string& bits) {
  return " SG_ " + name + " : " + bits + " (1,0) [0|0] \"\" X\n";
}
DbcFile parsed_dbc(const std::string& text) {
  return parse_dbc(text, "a.dbc");
}
std::string dbc_refused(const std::string& text) {
  return test::refusal([&] { return parsed_dbc(text); });
}
/// What is said of a message that is wanted.
std::string said_of(const std::string& text, const std::string& message) {
  const DbcFile file = parsed_dbc(text);
  return test::refusal([&] { return file.usable(message); });
}
std::string slips_of(const DbcFile& file) {
  std::string all;
  for (const std::string& slip : file.slips) all += slip + '\n';
  return all;
}

TEST(DbcFile, SaysWhichMessagesThereAreWhoSendsThemAndHowOften) {
  const DbcFile file = read_dbc(kExcavator);
  EXPECT_EQ(slips_of(file), "");
  EXPECT_EQ(file.messages.size(), 21U);
  const DbcMessage& command = file.usable("Joint_Rate_Cmd");
  EXPECT_EQ(command.id, 0x8DF02010);
  EXPECT_EQ(command.size, 8);
  EXPECT_EQ(command.sender, "Remote");
  EXPECT_DOUBLE_EQ(command.period_s.value(), 0.01);
  EXPECT_FALSE(command.j1939);
  EXPECT_EQ(file.usable("Pressures_1").id, 0x121U);
  EXPECT_DOUBLE_EQ(file.usable("Machine_State").period_s.value(), 0.1);  // the default
  EXPECT_FALSE(file.usable("Service_Data").period_s);                    // 0
  EXPECT_TRUE(file.usable("EEC1").j1939);
  EXPECT_FALSE(file.usable("Front_Angle").j1939);  // 29 bits alone are not J1939
}

TEST(DbcFile, SaysWhereASignalIsAndWhatItMeans) {
  const DbcFile file = read_dbc(kExcavator);
  const auto field = [&](const char* message, const char* signal) {
    const DbcSignal* const found = file.usable(message).find(signal);
    return found != nullptr ? found->field : BitField{};
  };
  struct Case {
    const char *message, *signal;
    BitField field;
  };
  for (const Case& c : std::initializer_list<Case>{
           {"Pressures_1", "boom_rod", {Type::kUnsigned, Order::kLittleEndian, 8, 8, 2, -100}},
           {"Pressures_2", "track_left_b", {Type::kUnsigned, Order::kBigEndian, 11, 12, 2, -100}},
           {"Front_Angle", "arm_angle", {Type::kSigned, Order::kBigEndian, 23, 16, 0.01, 0}},
           {"Front_Rate", "arm_rate", {Type::kSigned, Order::kLittleEndian, 16, 16, 0.0002, 0}},
           {"Hull_Tilt", "roll", {Type::kFloat, Order::kBigEndian, 39, 32, 1, 0}},
           {"Position_X", "position_x", {Type::kFloat, Order::kLittleEndian, 0, 64, 1, 0}},
           {"Odometer", "odometer", {Type::kUnsigned, Order::kLittleEndian, 0, 64, 0.001, 0}},
           {"HYD_TEMP", "oil_temperature_fine", {Type::kUnsigned, Order::kLittleEndian, 0, 16, 0.03125, -273}}}) {
    const BitField found = field(c.message, c.signal);
    EXPECT_EQ(found.type, c.field.type) << c.signal;
    EXPECT_EQ(found.order, c.field.order) << c.signal;
    EXPECT_EQ(found.start_bit, c.field.start_bit) << c.signal;
    EXPECT_EQ(found.bits, c.field.bits) << c.signal;
    EXPECT_EQ(found.scale, c.field.scale) << c.signal;
    EXPECT_EQ(found.offset, c.field.offset) << c.signal;
  }
  EXPECT_EQ(raw_of(field("Joint_Rate_Cmd", "swing_rate_cmd"), 0), 32000U);
  EXPECT_EQ(raw_of(field("Pilot_Pressure_Cmd", "boom_pilot"), 0), 2000U);
  EXPECT_EQ(file.messages[0].find("nobody"), nullptr);
}

TEST(DbcFile, SaysRangeAndUnitOfASignal) {
  const DbcFile file = read_dbc(kExcavator);
  const DbcSignal& pressure = *file.usable("Pressures_1").find("boom_bottom");
  EXPECT_EQ(pressure.range, (std::pair{-100.0, 400.0}));
  EXPECT_EQ(pressure.unit, "bar");
  EXPECT_FALSE(file.usable("Position_Y").find("position_y")->range);  // [0|0]
}

TEST(DbcFile, TellsBySignalsThatSelectWhichOthersAreInAFrame) {
  const DbcFile file = read_dbc(kExcavator);
  const auto present = [&](const char* name, std::initializer_list<std::uint8_t> bytes) {
    CanFrame frame;
    frame.size = 8;
    std::copy(bytes.begin(), bytes.end(), frame.data.begin());
    const DbcMessage& message = file.usable(name);
    std::string all;
    for (const DbcSignal& signal : message.signals)
      if (is_in(frame, message, signal)) all += signal.name + ' ';
    return all;
  };
  EXPECT_EQ(present("Service_Data", {0}), "item hours fuel_used checksum ");
  EXPECT_EQ(present("Service_Data", {1}), "item trim checksum ");
  EXPECT_EQ(present("Service_Data", {4}), "item checksum ");
  EXPECT_EQ(present("Diagnosis", {0x40}), "selector supply bus_load ");
  EXPECT_EQ(present("Diagnosis", {0x11}), "selector page spool fault bus_load ");
  EXPECT_EQ(present("Diagnosis", {0x31}), "selector page spool bus_load ");
  EXPECT_EQ(present("Diagnosis", {0xF1}), "selector page age bus_load ");
  EXPECT_EQ(present("Diagnosis", {0x03}), "selector current bus_load ");
  EXPECT_EQ(present("Diagnosis", {0x04}), "selector bus_load ");  // between two ranges
  CanFrame shorter{.id = 0x1A0, .size = 5, .data = {1, 2, 3}};
  EXPECT_TRUE(is_in(shorter, file.usable("Service_Data"), *file.usable("Service_Data").find("trim")));
  EXPECT_FALSE(is_in(shorter, file.usable("Service_Data"), *file.usable("Service_Data").find("checksum")));
  shorter.size = 0;
  EXPECT_FALSE(is_in(shorter, file.usable("Service_Data"), *file.usable("Service_Data").find("item")));
}

TEST(DbcFile, OfAMachineThatIsSoldIsReadWithoutASlip) {
  const std::string path = test::source_dir() + "/../shared/data/devices/zx200.dbc";
  if (!std::filesystem::exists(path))
    GTEST_SKIP() << "NOT TESTED: files of devices that are sold: no ../shared/data/devices";
  const DbcFile file = read_dbc(path);
  EXPECT_EQ(slips_of(file), "");
  std::size_t signals = 0;
  for (const DbcMessage& message : file.messages) {
    signals += file.usable(message.name).signals.size();
    EXPECT_TRUE(message.period_s) << message.name;
  }
  EXPECT_EQ(file.messages.size(), 22U);
  EXPECT_EQ(signals, 114U);
  EXPECT_EQ(raw_of(file.usable("Velocity_Cmd_1").find("boom_target_anguler_velocity")->field, 0), 32000U);
}

/// All that is said, for comparison.
std::string everything_in(const DbcFile& file) {
  std::ostringstream all;
  all << slips_of(file);
  for (const DbcMessage& m : file.messages) {
    all << m.id << m.name << m.size << m.sender << m.period_s.value_or(0) << m.j1939 << m.unusable;
    for (const DbcSignal& s : m.signals) {
      all << '\n' << s.name << int(s.field.type) << int(s.field.order) << int(s.field.start_bit) << int(s.field.bits);
      all << s.field.scale << s.field.offset << s.unit << s.line;
      if (s.condition) all << s.condition->multiplexer << s.condition->values.size();
    }
  }
  return all.str();
}

TEST(DbcFile, IsReadWithTheLineEndsAndBytesOfOtherComputers) {
  const std::string text = test::content(kExcavator), expected = everything_in(parsed_dbc(text));
  EXPECT_EQ(everything_in(parsed_dbc(all_changed(text, "\n", "\r\n"))), expected);
  EXPECT_EQ(everything_in(parsed_dbc(all_changed(text, "\n", "\r"))), expected);
  EXPECT_EQ(everything_in(parsed_dbc("\xEF\xBB\xBF" + text + '\x1A')), expected);
  EXPECT_EQ(everything_in(parsed_dbc(all_changed(text, " : ", ":"))), expected);
  const std::string degrees = replaced(kTwoMessages, "\"bar\"", "\"\xB0\"");
  EXPECT_EQ(parsed_dbc(degrees).messages[0].signals[0].unit, "\xC2\xB0");
}

TEST(DbcFile, WhatKnuckleDoesNotKnowIsPassedOverAndNothingElse) {
  const std::string before = "VERSION \"1\"\nNS_ :\n\tBO_\n\tVAL_\n\tNEW_\nBS_: 500:1,2\nBU_: Maker Other\n Third\n";
  const std::string after =
      "EV_ Switch: 0 [0|1] \"BO_ 5 X: 8 Y\" 0 1 DUMMY_NODE_VECTOR0 Vector__XXX;\nVAL_ Switch 1 \"on\" ;\n"
      "SIG_GROUP_ 256 Group 1 : a b;\nNEW_ 12 \"several\nVAL_ lines; \\\"quoted\\\"\" ;\nBA_REL_ \"x\" BU_BO_REL_ A "
      "256 5;\n"
      "BA_DEF_ EV_ \"x\" HEX 0 1;\nBA_ \"x\" EV_ Switch 5;\nCM_ EV_ Switch \"y\";\nCM_ BU_ Remote ;\nCM_ BU_ Remote "
      "\"y\" more;\nBO_TX_BU_ 256 : A,B;\n"
      "SIG_TYPE_REF_ 256 a : b;\nNO_SEMICOLON_ 1 2 3\nVAL_ 256 a 1 \"one\" ;\n";
  const DbcFile file = parsed_dbc(before + kTwoMessages + after);
  EXPECT_EQ(slips_of(file), "");
  EXPECT_EQ(file.messages.size(), 2U);
  EXPECT_EQ(file.usable("A").signals.size(), 2U);
}

TEST(DbcFile, SignalsThatNoMessageHasAreNotRead) {
  const std::string none =
      "BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 Vector__XXX\n SG_ x : 0|8@1+ (0,0) [0|0] \"\" Vector__XXX\n"
      " SG_ y : 0|8@1+ (0,0) [0|0] \"\" Vector__XXX\n\n";
  const std::string said =
      "CM_ SG_ 3221225472 x \"no\";\nBA_ \"GenMsgCycleTime\" BO_ 3221225472 5;\nVAL_ 3221225472 x 1 \"one\" ;\n"
      "SIG_VALTYPE_ 3221225472 x : 1;\nSG_MUL_VAL_ 3221225472 x y 0-0;\n";
  EXPECT_EQ(everything_in(parsed_dbc(none + kTwoMessages + said)),
            everything_in(parsed_dbc("\n\n\n\n" + kTwoMessages)));
}

TEST(DbcFile, MakesOnlyTheMessageUnusableThatIsNotUnderstood) {
  struct Case {
    std::string text;
    const char* said;
  };
  const std::string c = "BO_ 300 C: 4 X\n";  // line 5
  for (const Case& one : std::initializer_list<Case>{
           {sg("c", "25|8@1+"), "line 6: SG_ c of C: reaches to byte 5, and the message has 4"},
           {sg("c", "24|9@0+"), "line 6: SG_ c of C: reaches to byte 5, and the message has 4"},
           {sg("c", "0|0@1+"), "a number of bits within [1, 64] is expected at '0@1+"},
           {sg("c", "0|65@1+"), "a number of bits within [1, 64] is expected at '65@1+"},
           {sg("c", "64|1@1+"), "the first bit within [0, 63] is expected at '64|1@1+"},
           {sg("c", "-1|1@1+"), "the first bit within [0, 63] is expected at '-1|1@1+"},
           {" SG_ c : 0|8@1+ (0,0) [0|0] \"\" X\n", "SG_ c of C: has scale 0"},
           {" SG_ c : 0|8@1+ (nan,0) [0|0] \"\" X\n", "the scale within [-1e+300, 1e+300] is expected at 'nan,0)"},
           {" SG_ c : 0|8@1+ (1,1e301) [0|0] \"\" X\n", "the offset within [-1e+300, 1e+300] is expected at '1e301)"},
           {" SG_ c : 0|8@1+ (1,0,5) [0|0] \"\" X\n", "line 6: SG_ c of C: ')' is expected at ',5)"},
           {sg("c", "0|8@2+"), "byte order and sign (0 or 1, + or -) is expected at '2+"},
           {" SG_ c : 0|8@1+ (1,0) [0|0] \"bar X\n", "line 6: SG_ c of C: the unit in quotes begins with a quote"},
           {sg("c M2", "0|8@1+"), "M, mN, mNM (N a number) or ':' is expected at 'M2 :"},
           {sg("c m", "0|8@1+"), "M, mN, mNM (N a number) or ':' is expected at 'm :"},
           {" SG_ c : 0|8@1+ (1,0) [0|0] \"\" X;\n", "line 6: SG_ c of C: a receiver is expected at ';'"},
           {sg("c", "0|8@1+") + sg("c", "8|8@1+"), "line 7: SG_ c of C: is there twice"},
           {sg("c", "0|8@1+") + sg("d", "0|1@0+"),
            "line 7: SG_ d of C: shares bits with c of line 6, and no multiplexer tells them apart"},
           {sg("c", "0|16@1-") + "SIG_VALTYPE_ 300 c : 1;\n",
            "line 7: SIG_VALTYPE_: c of C is a float of 16 bits and must have 32"},
           {sg("c", "0|32@1-") + "SIG_VALTYPE_ 300 c : 2;\n",
            "line 7: SIG_VALTYPE_: c of C is a float of 32 bits and must have 64"},
           {sg("c", "0|32@1-") + "SIG_VALTYPE_ 300 c : 3;\n", "a type within [0, 2] is expected at '3;'"},
           {"SIG_VALTYPE_ 300 d : 1;\n", "line 6: SIG_VALTYPE_: C has no signal d"},
           {"SG_MUL_VAL_ 300 d e 0-0;\n", "line 6: SG_MUL_VAL_: C has no signal d"},
           {"BA_ \"GenMsgCycleTime\" BO_ 300 -5;\n", "a time in ms within [0, 3600000] is expected at '-5;'"},
           {"BA_ \"VFrameFormat\" BO_ 300 9;\n", "a value in quotes is expected at '9;'"},
           {"BO_ 300 D: 8 Y\n", "line 6: BO_ D: has the identifier of C of line 5"},
       }) {
    const std::string text = kTwoMessages + c + one.text;
    EXPECT_TRUE(says(said_of(text, "C"), one.said));
    EXPECT_EQ(said_of(text, "C").find("a.dbc: line "), 0U);
    EXPECT_EQ(said_of(text, "A"), "accepted") << one.text;
    EXPECT_TRUE(says(parsed_dbc(text).slips, one.said));
    for (const DbcMessage& message : parsed_dbc(text).messages)
      EXPECT_TRUE(message.unusable.empty() || message.signals.empty()) << one.text;
  }
  EXPECT_TRUE(says(said_of(kTwoMessages + c + "BO_ 300 D: 8 Y\n", "D"), "has the identifier of C"));
}

TEST(DbcFile, RefusesMultiplexersThatDoNotTellSignalsApart) {
  struct Case {
    std::string text;
    const char* said;
  };
  const std::string m = "BO_ 300 C: 8 X\n" + sg("m M", "0|4@1+");  // lines 5, 6
  for (const Case& one : std::initializer_list<Case>{
           {sg("c m1", "8|8@1+") + sg("d m2", "8|8@1+"), "accepted"},
           {sg("c m1", "8|8@1+") + sg("d m1", "15|2@0+"), "shares bits with c of line 7"},
           {sg("c m1", "8|8@1+") + sg("d", "8|8@1+"), "shares bits with c of line 7"},
           {sg("c m1", "3|8@1+"), "line 7: SG_ c of C: shares bits with m of line 6"},
           {sg("c m16", "8|8@1+"), "line 7: SG_ c of C: a value of multiplexer m must be at most 15"},
           {sg("c m1", "8|8@1+") + sg("n M", "4|4@1+"),
            "line 7: SG_ c of C: is multiplexed, and neither one multiplexer (M) nor SG_MUL_VAL_ says by which signal"},
           // By SG_MUL_VAL_:
           {sg("c m1", "8|8@1+") + sg("d m1", "8|8@1+") +
                "SG_MUL_VAL_ 300 c m 9-9, 0-2;\nSG_MUL_VAL_ 300 d m 3-8, 10-15;\n",
            "accepted"},
           {sg("c m1", "8|8@1+") + sg("d m1", "8|8@1+") + "SG_MUL_VAL_ 300 c m 9-9, 0-2;\nSG_MUL_VAL_ 300 d m 3-9;\n",
            "shares bits with c of line 7"},
           {sg("n m1M", "4|4@1+") + sg("c m0", "8|8@1+") + sg("d m2", "8|8@1+") + "SG_MUL_VAL_ 300 c n 0-1;\n",
            "accepted"},  // c only where m is 1, d where it is 2
           {sg("n m1M", "4|4@1+") + sg("c m0", "8|8@1+") + sg("d m1", "8|8@1+") + "SG_MUL_VAL_ 300 c n 0-1;\n",
            "shares bits with c of line 8"},
           {sg("n M", "4|4@1+") + sg("c m0", "8|8@1+") + sg("d m1", "8|8@1+") +
                "SG_MUL_VAL_ 300 c n 0-0;\nSG_MUL_VAL_ 300 d m 1-1;\n",
            "shares bits with c of line 8"},  // independent ones
           {sg("c m1", "8|8@1+") + "SG_MUL_VAL_ 300 c m 2-1;\n",
            "line 8: SG_MUL_VAL_: FROM-TO, two whole numbers in ascending order, is expected at '2-1;'"},
           {sg("c m1", "8|8@1+") + "SG_MUL_VAL_ 300 c m 1-4, 4-5;\n",
            "line 7: SG_ c of C: value 4 of multiplexer m is in two ranges"},
           {sg("c m1", "8|8@1+") + "SG_MUL_VAL_ 300 c m 1-16;\n", "must be at most 15"},
           {sg("c m1", "8|8@1+") + sg("d", "16|8@1+") + "SG_MUL_VAL_ 300 c d 1-1;\n",
            "line 7: SG_ c of C: d is no multiplexer (M) of whole numbers"},
           {sg("n m1M", "8|32@1+") + sg("c m1", "40|8@1+") + "SG_MUL_VAL_ 300 c n 1-1;\nSIG_VALTYPE_ 300 n : 1;\n",
            "line 8: SG_ c of C: n is no multiplexer (M) of whole numbers"},
           {sg("c m1M", "8|8@1+") + "SG_MUL_VAL_ 300 c c 1-1;\n",
            "line 7: SG_ c of C: depends on itself, or on more than 8 multiplexers"}}) {
    const std::string said = said_of(kTwoMessages + m + one.text, "C");
    EXPECT_TRUE(says(said, one.said)) << one.text;
  }
}

TEST(DbcFile, MessagesThatClassicCanCannotHaveAreThereAndUnusable) {
  const std::string more = "BO_ 300 Long: 39 X\n SG_ c : 0|312@1+ (1,0) [0|0] \"\" X\nBO_ 301 Fast: 8 X\n";
  const std::string fast =
      "BA_DEF_ BO_  \"VFrameFormat\" ENUM  \"StandardCAN\",\"StandardCAN_FD\";\nBA_ \"VFrameFormat\" BO_ 301 1;\n";
  const std::string text = kTwoMessages + more + "SIG_VALTYPE_ 300 c : 1;\n" + fast;
  EXPECT_EQ(
      said_of(text, "Long"),
      "a.dbc: line 5: BO_ Long: has 39 bytes, and a frame of classic CAN at most 8; in several packets come groups of "
      "J1939 alone (VFrameFormat J1939PG), of at most 255");
  EXPECT_EQ(said_of(text, "Fast"), "a.dbc: line 7: BO_ Fast: is of CAN FD (VFrameFormat)");
  EXPECT_EQ(slips_of(parsed_dbc(text)), "");  // neither is one
}

TEST(DbcFile, IdentifiersHaveElevenBitsOrTwentyNine) {
  const auto with = [](const std::string& id) { return said_of(kTwoMessages + "BO_ " + id + " C: 8 X\n", "C"); };
  EXPECT_EQ(with("2047"), "accepted");
  EXPECT_EQ(with("2684354559"), "accepted");  // 0x9FFFFFFF
  EXPECT_EQ(with("2048"),
            "a.dbc: line 5: BO_ C: identifier 2048 must be at most 2047, or 2147483648 more where it has 29 bits");
  EXPECT_EQ(with("2684354560"), "a.dbc: line 5: BO_ C: identifier 536870912 must be at most 536870911");
}

TEST(DbcFile, TellsEverySlipWithItsLineAndReadsOn) {
  struct Case {
    const char *more, *told;
  };
  for (const Case& c : std::initializer_list<Case>{
           {"VAL_ 256 a 1 \"x ;\n", "line 5: VAL_: a text begins with a quote and does not end"},
           {"CM_ \"x\"\n", "line 5: CM_: has no ';' at its end"},
           {"BA_ \"GenMsgCycleTime\" BO_ 5 100;\n", "line 5: BA_: there is no message 5"},
           {"BA_ \"GenSigStartValue\" SG_ 5 a 100;\n", "line 5: BA_: there is no message 5"},
           {"SIG_VALTYPE_ 5 a : 1;\n", "line 5: SIG_VALTYPE_: there is no message 5"},
           {"SG_MUL_VAL_ 5 a b 1-1;\n", "line 5: SG_MUL_VAL_: there is no message 5"},
           {"BO_ 300 C: 8 X\n SG_ c : 0|8@1+ (1,0) [5|-5] \"\" X\n",
            "line 6: SG_ c of C: its least value is above its most"},
           {"nonsense;\n", "line 5: nonsense: begins nothing that DBC files have: passed over"}}) {
    const DbcFile file = parsed_dbc(kTwoMessages + c.more + "BA_ \"GenMsgCycleTime\" BO_ 256 70;\n");
    EXPECT_TRUE(says(file.slips, c.told)) << c.more;
    EXPECT_EQ(file.slips.size(), 1U) << c.more << slips_of(file);
    EXPECT_EQ(file.usable("A").period_s, 0.07) << c.more << "is read on";
  }
}

TEST(DbcFile, RefusesWhatItCannotUnderstandAtAll) {
  struct Case {
    std::string text;
    const char* said;
  };
  for (const Case& c : std::initializer_list<Case>{
           {"", "a.dbc: is not a DBC file: it has no message (BO_)"},
           {"a = 5\n[table]\n", "a.dbc: is not a DBC file: it has no message (BO_)"},
           {kTwoMessages + std::string(1, '\0'), "has bytes that no text has"},
           {kTwoMessages + "BO_ x C: 8 X\n",
            "a.dbc: line 5: BO_: an identifier within [0, 4294967295] is expected at 'x C: 8 X'"},
           {kTwoMessages + "BO_ 4294967296 C: 8 X\n", "is expected at '4294967296"},
           {kTwoMessages + "BO_ 5 : 8 X\n",
            "a.dbc: line 5: BO_: the message's name of 1 to 128 characters is expected at ': 8 X'"},
           {kTwoMessages + "BO_ 5 C: x X\n", "line 5: BO_ C: a size in bytes within [0, 65535] is expected at 'x X'"},
           {kTwoMessages + "BO_ 5 C", "a.dbc: line 5: BO_ C: the file ends where ':' is expected"},
           {" SG_ a : 0|8@1+ (1,0) [0|0] \"\" X\n" + kTwoMessages,
            "a.dbc: line 1: SG_: stands behind no message (BO_)"},
           {kTwoMessages + "BO 5 C: 8 X\n SG_ c : 0|8@1+ (1,0) [0|0] \"\" X\n",
            "line 6: SG_: stands behind no message (BO_)"},
           {kTwoMessages + "CM_ \"without end;\n",
            "a.dbc: line 5: CM_: a comment begins with a quote and does not end"},
           {kTwoMessages + "CM_ SG_ 256 a \"without end;\nCM_ SG_ 256 b \"x\";\n", "expected at 'x\";'"},
           {kTwoMessages + all_changed(std::string(10001, '.'), ".", "x;\n"),
            "a.dbc: is not a DBC file: more than 10000 slips"}}) {
    EXPECT_TRUE(says(dbc_refused(c.text), c.said)) << c.text.substr(0, 300);
    EXPECT_EQ(dbc_refused(c.text).find("a.dbc: "), 0U);
  }
}

TEST(DbcFile, BoundsWhatIsHeldAgainstEachOther) {
  std::string many = "BO_ 300 C: 8 X\n SG_ m M : 0|16@1+ (1,0) [0|0] \"\" X\n", ranges = "SG_MUL_VAL_ 300 s1 m 0-0";
  for (int n = 1; n < 1000; ++n)
    many += " SG_ s" + std::to_string(n) + " m" + std::to_string(n) + " : 16|8@1+ (1,0) [0|0] \"\" X\n";
  for (int n = 1; n < 255; ++n) ranges += ", " + std::to_string(1000 + 2 * n) + "-" + std::to_string(1000 + 2 * n);
  EXPECT_EQ(said_of(many + ranges + ";\n", "C"), "accepted");
  EXPECT_TRUE(says(said_of(many + ranges + ", 5000-5000;\n", "C"), "must be fewer than 256 ranges"));
  EXPECT_TRUE(
      says(said_of(many + " SG_ x : 24|8@1+ (1,0) [0|0] \"\" X\n", "C"), "SG_ x of C: is one of more than 1000"));
}

TEST(DbcFile, IsAskedForAMessageByItsName) {
  const DbcFile file = parsed_dbc(kTwoMessages + "BO_ 300 A: 8 X\n");
  EXPECT_EQ(said_of(kTwoMessages, "Z"), "a.dbc: has no message 'Z'");
  EXPECT_EQ(said_of(kTwoMessages + "BO_ 300 A: 8 X\n", "A"), "a.dbc: line 5: BO_ A: there is one in line 1, too");
}

TEST(DbcFile, CutOffAnywhereIsReadOrRefusedInOneLine) {
  const std::string text = test::content(kExcavator);
  for (std::size_t size = 0; size < text.size(); size += 23) {
    const std::string said = dbc_refused(text.substr(0, size));
    EXPECT_FALSE(says(said, "\n"));
  }
}

}  // namespace
}  // namespace knuckle::eds
