// From a maker's DBC into a machine file and out again as DBC: the same raw values under the same multiplexer.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <sstream>

#include "app/eds/dbc_import.h"
#include "app/export/export_command.h"
#include "machine/load.h"
#include "tests/support/j1939_machine.h"
#include "tests/support/multiplexed_machine.h"

namespace knuckle::exporting {
namespace {

constexpr const char* kMakersDbc = R"(VERSION ""
BU_: Machine
BO_ 2566852641 Front: 8 Machine
 SG_ which M : 56|8@1+ (1,0) [0|0] "" Vector__XXX
 SG_ boom m1 : 0|16@1+ (0.0004,-10) [0|0] "rad" Vector__XXX
 SG_ arm m1 : 23|16@0+ (0.0004,-10) [0|0] "rad" Vector__XXX
 SG_ bucket m2 : 0|16@1- (0.01,0) [0|0] "deg" Vector__XXX
 SG_ pitch m2 : 16|32@1- (1,0) [0|0] "rad" Vector__XXX
BO_ 426 Body: 2 Machine
 SG_ hours : 0|16@1+ (0.5,0) [0|0] "h" Vector__XXX
BA_DEF_ BO_ "GenMsgCycleTime" INT 0 60000;
BA_DEF_DEF_ "GenMsgCycleTime" 0;
BA_ "GenMsgCycleTime" BO_ 2566852641 5;
BA_ "GenMsgCycleTime" BO_ 426 100;
SIG_VALTYPE_ 2566852641 pitch : 1;
)";

TEST(BusRoundTrip, ADbcThatWasImportedComesOutWithTheSameRawValues) {
  const eds::DbcFile maker = eds::parse_dbc(kMakersDbc, "m.dbc");
  const std::map<std::string, std::string> names{{"boom_angle", "Front.boom"},
                                                 {"arm_angle", "Front.arm"},
                                                 {"bucket_angle", "Front.bucket"},
                                                 {"slope", "Front.pitch"},
                                                 {"engine_hours", "Body.hours"}};
  eds::ImportOptions said;
  for (const auto& [ours, theirs] : names) said.signals.push_back(ours + "=" + theirs);
  const std::string before = whole_file(test::source_dir() + "/config/machines/solar015.toml", 1);
  const std::string text = eds::with_frames(before, "m.toml", maker, eds::wanted_of(said)).text;
  std::ostringstream out;
  write_dbc(parse_machine(text, "m.toml"), out);
  const eds::DbcFile ours = eds::parse_dbc(out.str(), "ours.dbc");
  EXPECT_TRUE(ours.slips.empty()) << ours.slips.front();
  EXPECT_EQ(ours.usable("Front").period_s, 0.005) << "two in turn, 10 ms each";
  std::mt19937_64 random(7);
  std::map<std::string, int> compared;
  for (int n = 0; n < 3000; ++n) {
    for (const char* const name : {"Front", "Body"}) {
      const eds::DbcMessage &theirs = maker.usable(name), &message = ours.usable(name);
      ASSERT_EQ(message.id, theirs.id);
      ASSERT_EQ(message.size, theirs.size);
      CanFrame frame{.id = message.id, .size = static_cast<std::uint8_t>(message.size), .data = {}};
      for (std::uint8_t& byte : frame.data) byte = static_cast<std::uint8_t>(random());
      frame.data[7] &= 3;
      for (const auto& [called, place] : names) {
        const std::string in_message = std::string(name) + ".";
        if (!place.starts_with(in_message)) continue;
        const eds::DbcSignal* const signal = message.find(called);
        const eds::DbcSignal* const source = theirs.find(place.substr(in_message.size()));
        ASSERT_NE(signal, nullptr) << called;
        const bool is = is_in(frame, message, *signal);
        ASSERT_EQ(is, is_in(frame, theirs, *source)) << called;
        if (!is) continue;
        EXPECT_EQ(read_raw(signal->field, frame), read_raw(source->field, frame)) << called;
        ++compared[called];
      }
    }
  }
  for (const auto& [called, place] : names) EXPECT_GT(compared[called], 500) << called;
}

TEST(BusRoundTrip, AGroupInSeveralPacketsComesBackAsItWas) {
  const MachineDescription machine = parse_machine(test::packets_text(), "m.toml");
  const auto is_it = [](const BroadcastFrame& frame) { return frame.name == "coolant"; };
  const auto coolant = [&](const std::vector<BroadcastFrame>& frames) {
    const auto at = std::find_if(frames.begin(), frames.end(), is_it);
    return at == frames.end() ? std::vector<BroadcastField>{} : at->fields;
  };
  std::ostringstream out;
  write_dbc(machine, out);
  const std::string before = whole_file(test::source_dir() + "/config/machines/solar015.toml", 1);
  const eds::Wanted wanted =
      eds::wanted_of({.signals = {"fuel_level=coolant.fuel_level", "coolant_temperature=coolant.coolant_temperature"}});
  const std::string text = eds::with_frames(before, "m.toml", eds::parse_dbc(out.str(), "ours.dbc"), wanted).text;
  ASSERT_EQ(coolant(machine.bus.broadcasts).size(), 2U);
  EXPECT_EQ(coolant(parse_machine(text, "m.toml").bus.broadcasts), coolant(machine.bus.broadcasts));
}

/// A name for each message, or nobody reads the file. Frames that a multiplexer tells apart are called as the first one
/// without the multiplexer's value.
TEST(BusRoundTrip, MessagesHaveNamesOfTheirOwnAlsoWhereWithoutTheMultiplexersValueTheyWouldNot) {
  const auto dbc_of_frames = [](const std::string& broadcasts) {
    std::ostringstream out;
    write_dbc(parse_machine(test::broadcast_text(broadcasts), "m.toml"), out);
    const eds::DbcFile dbc = eds::parse_dbc(out.str(), "ours.dbc");
    EXPECT_TRUE(dbc.slips.empty()) << dbc.slips.front();
    return dbc;
  };
  std::string text = test::replaced(test::multiplexed(test::kBroadcasts), "\"front_angle\"", "\"front_1\"");
  const eds::DbcFile one = dbc_of_frames(test::replaced(text, "\"body\"", "\"front\""));  // "front" is another's
  EXPECT_NE(one.usable("front").find("slope"), nullptr);
  EXPECT_NE(one.usable("front_1").find("boom_angle"), nullptr);
  EXPECT_NE(one.usable("front_1").find("boom_head_pressure"), nullptr);

  const std::string bits = "multiplexer = { start = 56, bits = 8, value = ";  // two messages, "front" both
  text = test::replaced(test::kBroadcasts, "\"front_angle\"", "\"front_1\"");
  text = test::replaced(text, "id = 0x18FF1021\n", "id = 0x18FF1021\n" + bits + "1 }\n");
  text = test::replaced(text, "\"pressure_1\"", "\"front_2\"");
  text = test::replaced(text, "id = 0x18FF2021\nbytes = 6\n", "id = 0x18FF2021\nbytes = 8\n" + bits + "2 }\n");
  const eds::DbcFile two = dbc_of_frames(text);
  EXPECT_NE(two.usable("front").find("boom_angle"), nullptr);
  EXPECT_NE(two.usable("front_2").find("boom_head_pressure"), nullptr);
}

}  // namespace
}  // namespace knuckle::exporting
