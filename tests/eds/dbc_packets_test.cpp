// `knuckle bus import`: J1939 groups of 9 to 255 bytes, which come in several packets.
#include <gtest/gtest.h>

#include "tests/eds/imports.h"

namespace knuckle::eds {
namespace {

using test::says;

constexpr const char* kPacketsDbc = R"(VERSION ""
BU_: Machine
BO_ 2583650558 Coolant: 20 Machine
 SG_ temperature : 52|8@1+ (1,-40) [-40|210] "degC" X
 SG_ motorola : 7|16@0+ (1,0) [0|0] "rpm" X
 SG_ serial : 60|72@1+ (1,0) [0|0] "" X
 SG_ which M : 0|8@1+ (1,0) [0|0] "" X
 SG_ hours m1 : 8|32@1+ (0.05,0) [0|0] "h" X
 SG_ level : 134|8@1+ (0.4,0) [0|100] "%" X
 SG_ boom : 144|16@1+ (0.0004,-10) [0|0] "rad" X
BO_ 2583650814 Long: 256 Machine
 SG_ level : 137|8@1+ (0.4,0) [0|100] "%" X
BO_ 2583651070 Plain: 20 Machine
 SG_ level : 137|8@1+ (0.4,0) [0|100] "%" X
BO_ 2583651326 Shared: 20 Machine
 SG_ level : 100|8@1+ (0.4,0) [0|100] "%" X
 SG_ other : 97|8@1+ (0.4,0) [0|100] "%" X
BO_ 2583651582 Beyond: 20 Machine
 SG_ level : 155|8@1+ (0.4,0) [0|100] "%" X
BA_DEF_ BO_ "GenMsgCycleTime" INT 0 60000;
BA_DEF_ BO_ "VFrameFormat" ENUM "StandardCAN","ExtendedCAN","reserved","J1939PG";
BA_DEF_DEF_ "GenMsgCycleTime" 1000;
BA_DEF_DEF_ "VFrameFormat" "J1939PG";
BA_ "VFrameFormat" BO_ 2583651070 1;
)";

Import packets_import(const ImportOptions& said) {
  return test::imported(said, kPacketsDbc, test::shipped_text());
}

TEST(DbcPackets, ReadingsOfAGroupInSeveralPacketsAreTaken) {
  const Import import =
      packets_import({.signals = {"coolant_temperature=Coolant.temperature", "fuel_level=Coolant.level"}});
  EXPECT_TRUE(import.gone_nodes.empty());
  EXPECT_TRUE(says(import.text, "name = \"Coolant\"\npgn = 0x1FF60\nbytes = 20\nperiod_ms = 1000\n"));
  EXPECT_TRUE(says(import.text, "fuel_level = { start = 134, bits = 8, scale = 0.4, unit = \"%\" }"));
  const BroadcastFrame frame = test::bus_of(import).broadcasts.at(0);
  ASSERT_EQ(frame.fields.size(), 2U);
  EXPECT_EQ(frame.fields[0].first_byte, 6) << "temperature";
  EXPECT_EQ(frame.fields[0].bits.start_bit, 4);
  EXPECT_EQ(frame.fields[1].first_byte, 16);
  EXPECT_EQ(frame.fields[1].bits.start_bit, 6);
}

TEST(DbcPackets, NoFrameHasASignalOfSuchAMessage) {
  const DbcFile file = parse_dbc(kPacketsDbc, "m.dbc");
  const DbcMessage& message = file.usable("Coolant");
  EXPECT_FALSE(is_in(CanFrame{.id = message.id, .size = 8}, message, *message.find("temperature")));
}

TEST(DbcPackets, WhatCannotBeIsRefusedInOneLine) {
  struct Case {
    ImportOptions wanted;
    const char* said;
  };
  for (const Case& c :
       {Case{{.signals = {"engine_speed=Coolant.motorola"}},
             "m.dbc:5: signal motorola of Coolant must be little endian and end within 8 bytes"},
        {{.signals = {"fuel_level=Coolant.serial"}},
         "m.dbc:6: signal serial of Coolant must be little endian and end within 8 bytes"},
        {{.signals = {"engine_hours=Coolant.hours"}}, "m.dbc:8: signal hours of Coolant is multiplexed"},
        {{.signals = {"boom_angle=Coolant.boom"}},
         "must be at most 8 of what moves the machine or stops it: several packets"},
        {{.signals = {"fuel_level=Long.level"}},
         "m.dbc: line 11: BO_ Long: has 256 bytes, and a frame of classic CAN at most 8; in "
         "several packets come groups of J1939 alone (VFrameFormat J1939PG), of at most 255"},
        {{.signals = {"fuel_level=Plain.level"}},
         "m.dbc: line 13: BO_ Plain: has 20 bytes, and a frame of classic CAN at most 8"},
        {{.signals = {"fuel_level=Shared.level"}}, "SG_ other of Shared: shares bits with level of line 16"},
        {{.signals = {"fuel_level=Beyond.level"}}, "SG_ level of Beyond: reaches to byte 21, and the message has 20"},
        {{.constants = {"Coolant=0"}},
         "m.dbc:3: Coolant has 20 bytes: what Knuckle sends must be one frame, of at most 8"},
        {{.signals = {"fuel_level=Coolant.level"}, .counters = {"Coolant.which"}}, "--counter Coolant.which"},
        {{.signals = {"fuel_level=Coolant.level"}, .counters = {"Coolant.temperature"}},
         "does not go with a message of several packets"}}) {
    test::expect_refused([&] { return packets_import(c.wanted); }, c.said);
  }
}

}  // namespace
}  // namespace knuckle::eds
