// Foreign recordings: what is wrong with them is named by row and column, what is left is right to the last digit.
#include "app/recordings/csv_reader.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "core/error.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::recordings {
namespace {

using Kind = Finding::Kind;

const std::string kTimeInSeconds = "[time]\ncolumn = \"t\"\nunit = \"s\"\ngap_s = 0.5\n";
const std::string kTwoChannels = R"(
[[channel]]
name = "a_rad"
column = "A"
unit = "deg"
sign = -1
offset = 10
[[channel]]
name = "p_Pa"
column = "P"
unit = "bar"
sign = 1
offset = 0
min = 0
max = 400
zero_is_drop_out = true
)";
const std::string kMap = kTimeInSeconds + kTwoChannels;

std::string written(const std::string& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
  return file;
}

MappedTable read(const std::string& csv, const std::string& map = kMap) {
  const test::TemporaryFolder folder;
  return read_mapped_csv(written(folder.file("table.csv"), csv), written(folder.file("map.toml"), map));
}

/// The refusal, without the folder of the file; "accepted" where there is none.
std::string refusal(const std::string& csv, const std::string& map = kMap) {
  const std::string text = test::refusal([&] { (void)read(csv, map); });
  return text.substr(text.rfind('/') + 1);
}

/// "9 P kDropOut" as "8:9:P".
std::string one(Kind kind, std::size_t row, const std::string& column) {
  return std::to_string(static_cast<int>(kind)) + ":" + std::to_string(row) + ":" + column + " ";
}

/// One behind the other.
std::string found(const MappedTable& table) {
  std::string text;
  for (const Finding& f : table.findings) text += one(f.kind, f.row, f.column);
  return text;
}

// Rows 2 to 6, 0.1 s apart.
constexpr const char* kGood = "t,A,P\n0,1,10\n0.1,2,20\n0.2,3,30\n0.3,4,40\n0.4,5,50\n";

TEST(CsvReader, AppliesUnitSignAndOffset) {
  const MappedTable table = read(kGood);
  EXPECT_EQ(table.findings.size(), 0u) << found(table);
  constexpr double kDeg = std::numbers::pi / 180;
  const auto& angle = table.channel("a_rad").values;
  ASSERT_EQ(angle.size(), 5u);
  EXPECT_NEAR(angle[0], (10 - 1) * kDeg, 1e-15);
  EXPECT_NEAR(angle[4], (10 - 5) * kDeg, 1e-15);
  EXPECT_NEAR(table.channel("p_Pa").values[1], 20e5, 1e-9);
  EXPECT_EQ(table.rows.back(), 6u);
  EXPECT_THROW((void)table.channel("b_rad"), InputError);
}

TEST(CsvReader, NamesEveryDefectByItsRowAndColumn) {
  struct Case {
    const char* csv;
    std::string findings;
    std::size_t used;
  };
  const Case cases[] = {
      {"t,A,P\n0,1,10\n0.1,2,20\n0.2,2,20\n0.3,3,30\n0.4,4,40\n", one(Kind::kRepeatedRow, 4, ""), 4},
      {"t,A,P\n0,1,10\n0.1,2,20\n0.1,3,30\n0.2,4,40\n0.3,5,50\n", one(Kind::kRepeatedTime, 4, "t"), 4},
      {"t,A,P\n0,1,10\n0.1,2,20\n9.9,3,30\n0.2,4,40\n0.3,5,50\n", one(Kind::kTimeOutOfOrder, 4, "t"), 4},
      {"t,A,P\n0.4,1,10\n0.1,2,20\n0.2,3,30\n0.3,4,40\n0.4,5,50\n", one(Kind::kRepeatedTime, 2, "t"), 4},
      {"t,A,P\n0,1,10\n0.1,2,20\n0.2,3,30\n0.8,4,40\n0.9,5,50\n", one(Kind::kGap, 5, "t"), 5},
      {"t,A,P\n0,1,10\n0.1,2,20\n0.2,3,30\n0.24,4,40\n0.34,5,50\n", one(Kind::kUnevenStep, 5, "t"), 5},
      {"t,A,P\n0,1,10\n0.1,2,\n0.2,3,30\n0.3,4,40\n", one(Kind::kMissing, 3, "P"), 4},
      {"t,A,P\n0,1,10\n,2,20\n0.1,3,30\n0.2,4,40\n0.3,5,50\n", one(Kind::kMissing, 3, "t"), 4},
      {"t,A,P\n0,1,10\n0.1,n/a,20\n0.2,3,30\n0.3,4,40\n", one(Kind::kNotANumber, 3, "A"), 4},
      {"t,A,P\n0,1,10\n0.1,nan,20\n0.2,3,30\n0.3,4,40\n", one(Kind::kNotANumber, 3, "A"), 4},
      {"t,A,P\n0,1,10\nlate,2,20\n0.1,3,30\n0.2,4,40\n0.3,5,50\n", one(Kind::kNotANumber, 3, "t"), 4},
      {"t,A,P\n0,0,10\n0.1,2,0.00\n0.2,3,30\n0.3,4,40\n", one(Kind::kDropOut, 3, "P"), 4},
      {"t,A,P\n0,1,10\n0.1,2,20\n0.2,3,401\n0.3,4,40\n", one(Kind::kOutOfRange, 4, "P"), 4},
      {"t,A,P\n0,1,10\n0.05,20\n0.1,3,30\n0.2,4,40\n0.3,5,50\n", one(Kind::kRaggedRow, 3, ""), 4},
      {"t,A,P\n0,1,10\n0.05,2,5,20\n0.1,3,30\n0.2,4,40\n0.3,5,50\n", one(Kind::kRaggedRow, 3, ""), 4},
  };
  for (const Case& c : cases) {
    const MappedTable table = read(c.csv);
    EXPECT_EQ(found(table), c.findings) << c.csv;
    EXPECT_EQ(table.time_s.size(), c.used) << c.csv;
  }
}

TEST(CsvReader, AnUnusableCellIsNotANumberAndItsNeighboursAreUsed) {
  const MappedTable table = read("t,A,P\n0,1,10\n0.1,2,0\n0.2,x,30\n0.3,4,40\n");
  EXPECT_TRUE(std::isnan(table.channel("p_Pa").values[1]));
  EXPECT_FALSE(std::isnan(table.channel("a_rad").values[1]));
  EXPECT_TRUE(std::isnan(table.channel("a_rad").values[2]));
  EXPECT_FALSE(std::isnan(table.channel("p_Pa").values[2]));
}

TEST(CsvReader, TellsUntilWhenRepeatedRowsHeldAValueButNotAcrossAGap) {
  const MappedTable table = read("t,A,P\n0,1,10\n0.1,1,10\n0.2,1,10\n1.2,1,10\n1.3,2,20\n1.4,3,30\n1.5,4,40\n");
  ASSERT_EQ(table.rows, (std::vector<std::size_t>{2, 6, 7, 8}));
  EXPECT_NEAR(table.until_s[0], 0.2, 1e-12);
  EXPECT_EQ(table.until_s[1], table.time_s[1]);
}

TEST(CsvReader, ReadsTheSameFromEveryWayOfWritingTheSameTable) {
  const MappedTable plain = read(kGood);
  for (const char* csv : {
           "t,A,P\r\n0,1,10\r\n0.1,2,20\r\n0.2,3,30\r\n0.3,4,40\r\n0.4,5,50\r\n",                  // Windows
           "t,A,P\r0,1,10\r0.1,2,20\r0.2,3,30\r0.3,4,40\r0.4,5,50",                                // old Mac, no end
           "\xEF\xBB\xBFt,A,P\n0,1,10\n0.1,2,20\n0.2,3,30\n0.3,4,40\n0.4,5,50\n",                  // byte order mark
           "\"t\",\"A\",\"P\"\n\"0\",\"1\",10\n0.1,\"2\",20\n0.2,3,\"30\"\n0.3,4,40\n0.4,5,50\n",  // quoted
           "t , A,P \n 0,1 ,10\n0.1, 2,20\n0.2,3,+30\n0.3,4,40.0\n4e-1,5,50\n",                    // spaces
           "P,more,A,t\n10,,1,0\n20,text,2,0.1\n30,\"a,b\",3,0.2\n40,\"q\"\"q\",4,0.3\n50,-,5,0.4\n",  // shuffled
           "t,A,P\n0,1,10,\n0.1,2,20,\n0.2,3,30,,\n0.3,4,40\n0.4,5,50\n",      // trailing commas
           "t,A,P,\n0,1,10\n0.1,2,20\n0.2,3,30\n0.3,4,40\n0.4,5,50\n",         // one in the header alone
           "t,A,P,,\n0,1,10\n0.1,2,20,\n0.2,3,30,,\n0.3,4,40\n0.4,5,50,,,\n",  // different ones
           "sep=,\nt,A,P\n0,1,10\n0.1,2,20\n0.2,3,30\n0.3,4,40\n0.4,5,50\n",   // said for a spreadsheet
           "\"SEP=;\"\r\nt;A;P\r\n0;1;10\r\n0.1;2;20\r\n0.2;3;30\r\n0.3;4;40\r\n0.4;5;50\r\n",
           "t;A;P\n0;1;10\n0.1;2;20\n0.2;3;30\n0.3;4;40\n0.4;5;50\n",
           "t\tA\tP\n0\t1\t10\n0.1\t2\t20\n0.2\t3\t30\n0.3\t4\t40\n0.4\t5\t50\n",
           "t|A|P\n0|1|10\n0.1|2|20\n0.2|3|30\n0.3|4|40\n0.4|5|50\n",
           "t;A;P\n0;1;10\n0,1;2,0;20\n0,2;3;30\n0,3;4;40\n0,4;5;50\n",  // decimal comma
           "t\tA\tP\n0\t1\t10\n0,1\t2\t20\n0,2\t3\t30\n0,3\t4\t40\n+4e-1\t5\t50,000\n",
           "\"t\",\"A\",\"P\"\n0,1,10\n\"0,1\",2,20\n\"0,2\",3,30\n\"0,3\",4,40\n\"0,4\",5,\"50,0\"\n",
           "x;t;A;P\n1,2,3;0;1;10\n;0,1;2;20\na,b;0,2;3;30\n;0,3;4;40\n;0,4;5;50\n",  // commas in another column
       }) {
    const MappedTable table = read(csv);
    EXPECT_EQ(found(table), "") << csv;
    EXPECT_EQ(table.time_s, plain.time_s) << csv;
    EXPECT_EQ(table.channel("a_rad").values, plain.channel("a_rad").values) << csv;
    EXPECT_EQ(table.channel("p_Pa").values, plain.channel("p_Pa").values) << csv;
  }
}

std::string utf16(const std::string& text, bool big_endian, bool mark) {
  std::string bytes = !mark ? "" : big_endian ? "\xFE\xFF" : "\xFF\xFE";
  for (const char c : text) bytes += big_endian ? std::string{'\0', c} : std::string{c, '\0'};
  return bytes;
}

TEST(CsvReader, ReadsTheEncodingsThatSpreadsheetsWriteAndSaysSo) {
  const MappedTable plain = read(kGood);
  for (const bool big_endian : {false, true}) {
    for (const bool mark : {false, true}) {
      const MappedTable table = read(utf16(kGood, big_endian, mark));
      EXPECT_EQ(table.time_s, plain.time_s);
      EXPECT_EQ(table.channel("p_Pa").values, plain.channel("p_Pa").values);
      EXPECT_EQ(table.notes, std::vector<std::string>{"read as UTF-16"});
    }
  }
  const std::string map = kTimeInSeconds +
                          "[[channel]]\nname = \"a_rad\"\ncolumn = \"Winkel \u00b0 \u20ac\"\nunit = \"deg\"\nsign = 1\n"
                          "offset = 0\n";
  const std::string rows = "\n0;1\n0,1;2\n0,2;3\n0,3;4\n";
  EXPECT_EQ(read("t;Winkel \xc2\xb0 \xe2\x82\xac" + rows, map).notes,
            std::vector<std::string>{"read as delimiter ';', decimal mark ','"});
  const std::string latin =
      "[[channel]]\nname = \"a_rad\"\ncolumn = \"Winkel \u00b0\"\nunit = \"deg\"\nsign = 1\noffset = 0\n";
  const MappedTable table = read("t;Winkel \xb0" + rows, kTimeInSeconds + latin);
  EXPECT_EQ(table.notes, std::vector<std::string>{"read as Latin-1, delimiter ';', decimal mark ','"});
  EXPECT_EQ(table.time_s.size(), 4u);
}

TEST(CsvReader, RefusesADecimalMarkThatIsNotCertainAndNamesTheDelimiter) {
  const std::pair<const char*, const char*> cases[] = {
      {"t;A;P\n0;1,5;10\n0,1;2;20\n0,2;3.5;30\n0,3;4;40\n",
       "delimiter ';': the decimal mark is not certain: row 2 has '1,5', row 4 '3.5'"},
      {"t,A,P\n0,1,\"1,278\"\n1,2,\"2,300\"\n2,3,30\n3,4,40\n",
       "delimiter ',': the decimal mark is not certain: '1,278' in row 2 may be a number with a decimal comma, or a "
       "thousand"},
  };
  for (const auto& [csv, part] : cases) EXPECT_TRUE(test::says(refusal(csv), part));
  EXPECT_EQ(found(read("t,A,P\n0,1,\"1,278\"\n0.1,2,20\n0.2,3,30\n0.3,4,40\n")), one(Kind::kNotANumber, 2, "P"))
      << "other cells have a point";
}

TEST(CsvReader, TakesUnixTimeInAnyUnitWhereTheMappingSaysNone) {
  const std::string map = "[time]\ncolumn = \"t\"\ngap_s = 0.5\n" + kTwoChannels;
  for (const auto& [zeros, unit] : {std::pair{"", "s"}, {"000", "ms"}, {"000000", "us"}, {"000000000", "ns"}}) {
    std::string csv = "t,A,P\n";
    for (int i = 0; i < 5; ++i) csv += std::to_string(1'766'147'454 + i) + zeros + "," + std::to_string(i) + ",10\n";
    const MappedTable table = read(csv, map);
    EXPECT_EQ(table.time_s, (std::vector<double>{0, 1, 2, 3, 4})) << unit;
    EXPECT_EQ(table.notes, std::vector<std::string>{std::string("t is Unix time in ") + unit});
    const std::string said = "[time]\ncolumn = \"t\"\nunit = \"" + std::string(unit) + "\"\ngap_s = 2\n" + kTwoChannels;
    EXPECT_EQ(read(csv, said).time_s, table.time_s);
  }
  EXPECT_TRUE(test::says(refusal(kGood, map), "the mapping must say its unit: s, ms, us or ns"));
  // Nanoseconds since a start, two seconds of them, are no Unix time in seconds.
  EXPECT_TRUE(test::says(refusal("t,A,P\n2000000000,1,1\n2005000000,2,2\n2010000000,3,3\n2015000000,4,4\n", map),
                         "must say its unit"));
  EXPECT_TRUE(test::says(refusal("t,A,P\n1766147454000000000,1,1\n1766147454100000000,2,2\n1766147454200000000,3,3\n"
                                 "1766147454300000000,4,4\n"),
                         "; its times look like Unix time in ns; "));
}

TEST(CsvReader, LeavesAFewRowsOutWhoseTimeIsFarFromAllOthers) {
  const std::string rows = "0,1,10\n0.1,2,20\n0.2,3,30\n0.3,4,40\n0.4,5,50\n";
  struct Case {
    std::string csv, findings;
    std::size_t used;
  };
  const auto strays = [](std::size_t first, std::size_t count) {
    std::string text;
    for (std::size_t i = 0; i < count; ++i) text += one(Kind::kStrayTime, first + i, "t");
    return text;
  };
  const Case cases[] = {
      {"t,A,P\n" + rows + "1766147473.99,9,9\n", strays(7, 1), 5},
      {"t,A,P\n-1766147473,9,9\n" + rows, strays(2, 1), 5},
      {"t,A,P\n-9999,8,8\n" + rows + "99999,9,9\n99999.1,9,8\n", strays(2, 1) + strays(8, 2), 5},
      {"t,A,P\n" + rows + "8,9,9\n8.1,8,9\n8.2,7,9\n", strays(7, 3), 5},
      // A gap, as those of recordings: as much stands behind it as before.
      {"t,A,P\n" + rows + "8,9,9\n8.1,8,9\n8.2,7,9\n8.3,6,9\n", one(Kind::kGap, 7, "t"), 9},
      {"t,A,P\n" + rows + "4,9,9\n", one(Kind::kGap, 7, "t"), 6},
  };
  for (const Case& c : cases) {
    const MappedTable table = read(c.csv);
    EXPECT_EQ(found(table), c.findings) << c.csv;
    EXPECT_EQ(table.time_s.size(), c.used) << c.csv;
  }
}

TEST(CsvReader, CountsRowsAsASpreadsheetDoesPastBlankLinesAndQuotedOnes) {
  const MappedTable table = read("t,A,P,note\n\n0,1,10,\"two\nlines\"\n,,,\n0.1,2,0,\n0.2,3,30,\n0.3,4,40,\n");
  EXPECT_EQ(found(table), one(Kind::kDropOut, 5, "P"));
  EXPECT_EQ(table.rows_read, 4u);
}

TEST(CsvReader, TakesTimeFromAFixedPeriod) {
  const std::string fixed = std::string("[time]\nperiod_s = 0.05\ngap_s = 0.5\n") + kTwoChannels;
  const MappedTable spaced = read("A,P\n1,10\n2\n3,30\n4,40\n5,50\n", fixed);
  EXPECT_NEAR(spaced.time_s[1], 0.1, 1e-12) << "a row that is left out takes its time all the same";
  EXPECT_NEAR(spaced.time_s[3], 0.2, 1e-12);
}

TEST(CsvReader, FindsDatesAndTimesInsideTextAcrossMidnightAndTheEndOfAYear) {
  const std::string dated =
      std::string("[time]\ncolumn = \"img\"\npattern = \"YYYYMMDD_HHMMSS.mmm\"\ngap_s = 0.5\n") + kTwoChannels;
  const MappedTable table = read(
      "img,A,P\nP_20231231_235959.900,1,10\n20231231_235959.950,2,20\nx20240101_000000.000y,3,30\n"
      "20240101_000000.250,4,40\n20240230_000000.300,5,50\n20240101_000000,6,60\n",
      dated);
  EXPECT_EQ(found(table),
            one(Kind::kUnevenStep, 5, "img") + one(Kind::kNotANumber, 6, "img") + one(Kind::kNotANumber, 7, "img"));
  ASSERT_EQ(table.time_s.size(), 4u);
  EXPECT_NEAR(table.time_s[1], 0.05, 1e-6);
  EXPECT_NEAR(table.time_s[2], 0.10, 1e-6);
  EXPECT_NEAR(table.time_s[3], 0.35, 1e-6);
  const std::string iso =
      std::string("[time]\ncolumn = \"t\"\npattern = \"YYYY-MM-DDTHH:MM:SS\"\ngap_s = 5\n") + kTwoChannels;
  const MappedTable seconds = read(
      "t,A,P\n2024-02-28T23:59:59Z,1,10\n2024-02-29T00:00:01Z,2,20\n2024-02-29T00:00:03Z,3,30\n"
      "2024-02-29T00:01:00Z,4,40\n",
      iso);
  EXPECT_NEAR(seconds.time_s[1], 2, 1e-6);
  EXPECT_NEAR(seconds.time_s[3], 61, 1e-6);
}

TEST(CsvReader, ReportsEachKindOnceWithItsRows) {
  const MappedTable table = read("t,A,P\n0,1,10\n0.1,2,0\n0.2,3,0\n0.3,4,40\n0.4,5,0\n0.5,6,60\n0.55,7\n0.6,x,70\n");
  const std::vector<std::string> lines = table.report();
  ASSERT_EQ(lines.size(), 4u);
  EXPECT_TRUE(test::says(lines[0], "8 rows, 7 used"));
  EXPECT_EQ(lines[1], "1 x row with another number of cells than the header (left out): row 8");
  EXPECT_EQ(lines[2], "1 x cell that is not a number (not used) in A: row 9");
  EXPECT_EQ(lines[3], "3 x drop-out (not used) in P: row 3-4, 6");
  EXPECT_EQ(row_list({2, 3, 4, 9, 11}, 2), "2-4, 9 and 1 more");
}

TEST(CsvReader, RefusesWithOneLineWhatCannotBeRead) {
  EXPECT_EQ(refusal(""), "table.csv: is empty");
  const std::pair<const char*, const char*> cases[] = {
      {"\n \r\n", "is empty"},
      {"t,A,P\n", "0 usable rows of 0, at least 4"},
      {"t,A,P\n0,1,10\n0.1,2,20\n0.2,3,30\n", "3 usable rows of 3, at least 4"},
      {"t,A,P\n0,1,10\n0,2,20\n0,3,30\n0,4,40\n0,5,50\n",
       "1 usable rows of 5, at least 4 are needed; 4 x repeated time (left out) in t: row 3-6"},
      {"t,B,P\n0,1,10\n", "row 1: no column 'A'"},
      {"t;B;P\n0;1;10\n", "row 1: no column 'A'; with delimiter ';' there are 't', 'B', 'P'"},
      {"t,A,A,P\n0,1,1,10\n", "row 1: column 'A' appears twice"},
      {"t,A,P\n0,1,10\n0.1,\"2,20\n0.2,3,30\n0.3,4,40\n", "row 3: a quote"},
      {"t,A,P\n0,1,10\n0.1,2\"x\",20\n0.2,3,30\n0.3,4,40\n", "row 3: a quote"},
  };
  for (const auto& [csv, part] : cases) {
    const std::string line = refusal(csv);
    EXPECT_TRUE(test::says(line, part));
    EXPECT_FALSE(test::says(line, "\n"));
  }
  const test::TemporaryFolder folder;
  const std::string map = written(folder.file("map.toml"), kMap);
  EXPECT_THROW((void)read_mapped_csv(folder.path().string(), map), InputError);
  EXPECT_THROW((void)read_mapped_csv("/nowhere.csv", map), InputError);
}

TEST(CsvReader, RefusesAMappingThatCannotMeanAnything) {
  const std::string &time = kTimeInSeconds, &channels = kTwoChannels;
  const std::pair<std::string, const char*> cases[] = {
      {time, "channel"},
      {channels, "time"},
      {time + channels + "extra = 1\n", "extra"},
      {"[time]\ncolumn = \"t\"\npattern = \"YYYYMMDD\"\ngap_s = 1\n" + channels, "pattern"},
      {"[time]\ncolumn = \"t\"\nunit = \"min\"\ngap_s = 1\n" + channels, "unit"},
      {time + "[[channel]]\nname = \"a\"\ncolumn = \"A\"\nunit = \"deg\"\nsign = 0\noffset = 0\n", "sign"},
      {time + "[[channel]]\nname = \"a\"\ncolumn = \"A\"\nunit = \"deg\"\nsign = 1\noffset = 0\nmin = 2\nmax = 1\n",
       "max"},
      {time + channels + channels, "name"},
  };
  for (const auto& [map, key] : cases) {
    const std::string line = refusal(kGood, map);
    EXPECT_TRUE(test::says(line, ".toml"));
    EXPECT_TRUE(test::says(line, key));
  }
}

}  // namespace
}  // namespace knuckle::recordings
