// What `knuckle info` says of a file: all that a person asks first, on one screen.
#include "app/recordings/info.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "app/recordings/import.h"
#include "app/recordings/recording_reader.h"
#include "core/error.h"
#include "recording/mcap/file_writer.h"
#include "recording/recording.h"
#include "tests/identify/recorded_motion.h"
#include "tests/recording/rewrite.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::recordings {
namespace {

class Info : public testing::Test {
 protected:
  Info() {
    std::ofstream out(csv_);
    write_recording(part_of(identify::recorded_motion(), 1000, 2000), out);
    out.close();
    recording::Head head;
    head.program = "knuckle import table.csv";
    head.version = "1.2.3";
    head.machine_file = "a machine";
    write_imported(read_recording(csv_, "", test::solar()), head, test::solar(), mcap_);
  }
  std::string put(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.file(name), std::ios::binary) << text;
    return folder_.file(name);
  }

  test::TemporaryFolder folder_;
  std::string csv_ = folder_.file("table.csv"), mcap_ = folder_.file("table.mcap");
};

constexpr std::size_t kScreenLines = 40;

void expect_says(const FileInfo& info, bool whole, const std::vector<std::string>& parts) {
  std::string all;
  for (const std::string& line : info.lines) all += line + "\n";
  for (const std::string& part : parts) EXPECT_TRUE(test::says(all, part));
  EXPECT_EQ(info.whole, whole) << all;
  EXPECT_LE(info.lines.size(), kScreenLines);
}

TEST_F(Info, OfARecordingSaysWhatItIsOfAndThatItIsWhole) {
  expect_says(recording_info(mcap_), true,
              {"B, whole", "imported table of the machine's side", "by knuckle import table.csv (1.2.3)",
               "virtual, 0.000 s to 4.995 s: 4.995 s", "machine.toml (9 bytes)",
               "/machine/state             1000      200.0        0.000        4.995"});
}

TEST_F(Info, OfADamagedOrCutOffRecordingSaysSo) {
  const std::string whole = test::content(mcap_);
  std::string damaged = whole;
  damaged[whole.size() / 2] ^= 1;
  const std::string stump = put("stump.mcap", whole.substr(0, 100));
  expect_says(recording_info(put("damaged.mcap", damaged)), false, {"B, damaged", "imported table", "left out"});
  expect_says(recording_info(put("cut.mcap", whole.substr(0, whole.size() / 2))), false, {"B, damaged", "cut off"});
  expect_says(recording_info(stump), false, {"recording of Knuckle, cut off before what it is of"});
  EXPECT_TRUE(test::begins(test::refusal([&] { const recording::Recording unreadable({stump}); }),
                           stump + ": is cut off before what makes it a recording of Knuckle"));
  EXPECT_THROW((void)recording_info(put("none.mcap", "time_s\n")), InputError);
}

/// A file of Knuckle's, of any version, or of another program.
std::string put_mcap(const std::string& path, const std::vector<mcap::Metadata>& notes, std::uint64_t at_ns,
                     bool ended) {
  mcap::FileWriter writer;
  mcap::Topics topics;
  (void)topics.add(mcap::Channel{"/x", "json", 0, {}});
  EXPECT_TRUE(writer.open(path, topics));
  for (const mcap::Metadata& note : notes) EXPECT_TRUE(writer.note(note));
  mcap::ChunkBuilder builder;
  for (std::uint32_t i = 0; i < 3; ++i) builder.add(1, i, at_ns + 500'000'000 * i, 0, std::vector<std::uint8_t>(9));
  EXPECT_TRUE(writer.append(builder.finish({})));
  if (ended)
    EXPECT_TRUE(writer.close());
  else
    writer.abandon();
  return path;
}

TEST_F(Info, OfOtherVersionsAndProgramsSaysWhatItCanAndDoubtsClocks) {
  recording::Head head;
  head.program = "knuckle slave --can can0";
  head.version = "0.0.1";
  head.has_machine = true;
  head.part = 0;
  mcap::Metadata old = recording::metadata_of(head);
  old.values["link_version"] = "1";
  constexpr std::uint64_t kSecond_ns = 1'000'000'000;
  expect_says(recording_info(put_mcap(folder_.file("old.mcap"), {old}, 100 * kSecond_ns, false)), false,
              {"has no end: its program was killed", "flight record of the machine's side",
               "by knuckle slave --can can0 (0.0.1)", "1970-01-01 00:01:40.000", "1.000 s (the clock was not set)"});
  expect_says(recording_info(put_mcap(folder_.file("other.mcap"), {}, 4'000'000'000 * kSecond_ns, true)), true,
              {"MCAP file of another program", "2096-10-02 07:06:40.000", "(the clock was ahead", "/x"});
}

TEST_F(Info, OfAnotherVersionSaysWhichFieldsItsStatesLackAndWhetherTheyCanBeUsed) {
  const auto with = [&](const std::string& name, const std::string& from, const std::string& to) {
    const auto keep = [](const std::string&, std::vector<std::uint8_t>&) { return true; };
    test::rewrite(mcap_, folder_.file(name), recording::Recording({mcap_}).head(), mcap::Compression{1}, keep,
                  [&](mcap::Topics& topics) {
                    for (auto& [id, schema] : topics.schemas)
                      if (const auto at = schema.data.find(from); at != std::string::npos)
                        schema.data.replace(at, from.size(), to);
                  });
    return recording_info(folder_.file(name));
  };
  expect_says(with("older.mcap", "float64 round_trip_s\n", ""), true,
              {"  /machine/state: recorded by another version of Knuckle, without round_trip_s\n"});
  expect_says(with("other.mcap", "float64 round_trip_s\n", "uint8 round_trip_s\n"), false,
              {"  cannot be used: /machine/state: round_trip_s is recorded as uint8, and is float64 in this"});
}

TEST_F(Info, OfATableNamesItsSignalsTheirRangeAndWhatIsWrong) {
  expect_says(table_info(csv_, ""), true,
              {csv_ + ": table, ", "1000 rows, 14 columns", "4.995 s, usual step 0.005 s", "boom_head_Pa ",
               "nothing wrong with it was found"});
  std::string text = test::content(csv_);
  std::replace(text.begin(), text.end(), ',', ';');
  const std::size_t row = text.find('\n', text.size() / 2) + 1;
  const std::string odd = put("odd.csv", text.substr(0, row) + text.substr(text.find('\n', row + 1) + 1));
  expect_says(table_info(odd, ""), true, {"read as delimiter ';', decimal mark '.'", "1 x uneven step in time"});
}

TEST_F(Info, OfATableOfAnotherProgramSaysWhatAMappingMakesOfItOrWhatStandsInIt) {
  const std::string table = put("other.csv",
                                "Zeit;Druck;Text;\n1766147454,0;17,5;a\n1766147455,0;18,5;b\n1766147456,0;19,5;c\n"
                                "1766147457,0;20,5;d\n");
  expect_says(
      table_info(table, ""), true,
      {"bytes, 4 rows, 3 columns; delimiter ';', decimal mark ','", "Druck                         4  17.5 to 20.5",
       "time, 2025-12-19 12:30:54 to 2025-12-19 12:30:57 UTC", "--map FILE.toml says what its columns are"});
  const std::string good = "Zeit,Druck\n1766147454,17\n1766147455,18\n1766147456,19\n";
  for (const char* odd : {"1766147457000000000", "1e300"})  // one in nanoseconds, or nonsense
    expect_says(table_info(put("last.csv", good + odd + ",20\n"), ""), true, {"time, not certain"});
  const std::string map = put("map.toml",
                              "[time]\ncolumn = \"Zeit\"\ngap_s = 2\n[[channel]]\nname = \"p_Pa\"\ncolumn = \"Druck\"\n"
                              "unit = \"bar\"\nsign = 1\noffset = 0\n");
  expect_says(table_info(table, map), true,
              {"3.000 s, usual step 1 s", "1.75e+06 to 2.05e+06", "p_Pa", "Zeit is Unix time in s"});
  expect_says(table_info(put("short.csv", "Zeit;Druck\n1766147454;17\n1766147455;18\n"), map), false,
              {"cannot be used: ", "at least 4 are needed"});
}

TEST_F(Info, OfATextWithoutColumnsOfNumbersSaysThatItCannotBeUsed) {
  for (const char* text : {"(0000000000.001130) can0 710#00\n(0000000000.001260) can0 711#00\n",
                           "level on solar015, seed 1: 2.0 s simulated\n  moved freely for 1 s; no fault\n"})
    expect_says(table_info(put("text.log", text), ""), false, {": table, ", "  cannot be used: no column has numbers"});
}

}  // namespace
}  // namespace knuckle::recordings
