// Rows in files: taken up where a run ended, never mixed with another battery's, never destroying what is not theirs;
// and the figures made of them.
#include "app/battery/rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "app/battery/effects.h"
#include "app/battery/table.h"
#include "core/error.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::battery {
namespace {

Settings feel() {
  return load_settings(test::source_dir() + "/config/grids/feel.toml");
}

RowsKey feel_key() {
  return rows_key(feel());
}

/// A row with these values of the metrics that verdicts go by.
Row row_of(std::uint64_t index, double rtt_ms, double losses, double swing_N, double error_N, double unfelt_s = 0) {
  Row row{{"cell", index},
          {"drawn",
           {{"rtt_ms", rtt_ms},
            {"limb", "normal"},
            {"place", "front"},
            {"part", "tip"},
            {"stiffness_N_per_m", 3e5},
            {"speed_mps", 0.1},
            {"loss", 0}}}};
  row["digest"] = "of session " + std::to_string(index);
  row["metrics"] = {{"contact_losses", losses},
                    {"hold_peak_to_peak_N", swing_N},
                    {"hold_error_N", error_N},
                    {"hold_error_share", error_N / 0.3},
                    {"unfelt_s", unfelt_s}};
  row["faults"] = Row::array();
  row["failed"] = Row::array();
  if (losses > 2) row["failed"].push_back("contact_losses");
  if (swing_N > 1) row["failed"].push_back("hold_peak_to_peak_N");
  if (error_N > 0.3) row["failed"].push_back("hold_error_share");
  return row;
}

const Figure& figure(const Group& group, const std::string& name) {
  return *std::ranges::find(group.figures, name, &Figure::name);
}

class RowsFileTest : public testing::Test {
 protected:
  [[nodiscard]] std::string text() const { return test::content(path_); }
  void write(const std::string& text) const { std::ofstream(path_, std::ios::binary) << text; }
  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("rows.jsonl");
};

TEST_F(RowsFileTest, ComesBackAsItWasWrittenToOneProcessAtATimeWithoutALineThatWasCutOff) {
  {
    RowsFile file(path_, feel_key());
    EXPECT_TRUE(file.there().empty());
    EXPECT_THROW(RowsFile(path_, feel_key()), InputError);
    file.add(row_of(3, 20, 0, 0.1, 0.1));
    file.add(row_of(1, 20, 0, 0.1, 0.1));
  }
  const std::string whole = text();
  write(whole + R"({"cell":4,"drawn":{"rtt_)");
  const RowsFile again(path_, feel_key());
  EXPECT_EQ(text(), whole);
  ASSERT_EQ(again.there().size(), 2U);
  EXPECT_EQ(again.there().at(3).dump(), row_of(3, 20, 0, 0.1, 0.1).dump());
  EXPECT_EQ(read_rows(path_, feel_key()).size(), 2U);
}

TEST_F(RowsFileTest, RefusesAnotherBatterysRowsAndSaysWhatDiffers) {
  { RowsFile(path_, feel_key()).add(row_of(3, 20, 0, 0.1, 0.1)); }
  Settings other = feel();
  other.family = "worn";
  const std::string said = test::refusal([&] { (void)read_rows(path_, rows_key(other)); });
  EXPECT_TRUE(test::says(said, "family = \"smooth\", not \"worn\""));
  EXPECT_THROW(RowsFile(path_, rows_key(other)), InputError);
}

TEST_F(RowsFileTest, LeavesAFileThatIsNoneAsItIs) {
  for (const char* foreign : {"no line end", "name = \"solar015\"\nlinks = 3\n", "{\"schema\":\"other\"}\n"}) {
    write(foreign);
    EXPECT_THROW(RowsFile(path_, feel_key()), InputError);
    EXPECT_THROW((void)read_rows(path_, feel_key()), InputError);
    EXPECT_EQ(text(), foreign);
  }
}

TEST(BatteryTable, CountsWhatIsStableRightAndTold) {
  Rows rows;
  rows[0] = row_of(0, 20, 0, 0.2, 0.1);        // right
  rows[1] = row_of(1, 20, 2, 0.9, 0.31, 0.4);  // stable only, something unfelt
  rows[2] = row_of(2, 50, 3, 0.2, 0.1);        // loses contact
  rows[3] = row_of(3, 50, 0, 1.2, 0.1);        // swings
  rows[4] = row_of(4, 50, 0, 0.2, 0.1);
  rows[4]["failed"] = {"faults"};
  rows[5] = row_of(5, 50, 0, 0.2, 0.1);
  rows[5]["failed"] = {"phases_timed_out"};  // not held to its end: not stable, and not left out
  rows[6] = {{"cell", 6}, {"drawn", rows[5]["drawn"]}, {"refused", "no such pose"}};
  const std::vector<Group> groups = groups_of(rows, Kind::kFeel);
  const Group& all = groups.front();
  EXPECT_EQ(all.drawn, 7U);
  EXPECT_EQ(all.refused, 1U);
  EXPECT_NEAR(*figure(all, "stable").value, 2.0 / 6, 1e-12);
  EXPECT_NEAR(*figure(all, "stable and right").value, 1.0 / 6, 1e-12);
  EXPECT_NEAR(*figure(all, "nothing unfelt").value, 5.0 / 6, 1e-12);
  EXPECT_EQ(figure(all, "hold_error_N p95").of, 6U);
  EXPECT_FALSE(figure(all, "felt_error_rel median").value) << "no session has it: said, not left out";
  double at_20 = -1;
  for (const Group& group : groups) {
    if (group.by == "rtt_ms" && group.value == "20") at_20 = *figure(group, "stable").value;
  }
  EXPECT_EQ(at_20, 1);
}

TEST(BatterySensitivity, FindsWhatAMetricGoesWithAndNothingElse) {
  Rows rows;
  for (std::uint64_t i = 0; i < 60; ++i) {
    Row row = row_of(i, 20, 0, 0.1, 0.1);
    const double x = static_cast<double>((37 * i) % 61), unrelated = static_cast<double>((i * i * 17 + 5 * i) % 59);
    row["effects"] = {{"stiction", x}, {"hull slope", unrelated}, {"settling", 0.0}};
    row["metrics"]["hold_error_N"] = std::exp(-0.1 * x);  // falls, by any curve
    rows[i] = row;
  }
  const std::vector<Sensitivity> found = sensitivities(rows);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].effect, "stiction");
  EXPECT_EQ(found[0].metric, "hold_error_N");
  EXPECT_NEAR(found[0].correlation, -1, 1e-12);
  for (const Sensitivity& one : found) {
    EXPECT_NE(one.effect, "settling") << "does not vary";
    if (one.effect == "hull slope") {
      EXPECT_LT(std::abs(one.correlation), 0.4);
    }
  }
}

TEST_F(RowsFileTest, RefusesLinesThatAreNoRows) {
  { RowsFile(path_, feel_key()).add(row_of(3, 20, 0, 0.1, 0.1)); }
  const std::string whole = text();
  for (const char* line : {"{\"cell\":0}", "[]", "{\"cell\":1000000000,\"drawn\":{},\"refused\":\"\"}", "nonsense"}) {
    write(whole + line + "\n");
    EXPECT_THROW((void)read_rows(path_, feel_key()), InputError) << line;
  }
}

}  // namespace
}  // namespace knuckle::battery
