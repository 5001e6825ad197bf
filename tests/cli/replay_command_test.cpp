// `knuckle replay` as a user runs it, on a short session.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "core/quantile.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::cli {
namespace {

class ReplayCommand : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TemporaryFolder;
    session_ = folder_->file("session.mcap");
    const auto made = test::run_program(
        test::program("knuckle"), {"simulate", "--scenario", "wall_contact", "--duration", "4", "--log", session_});
    ASSERT_NE(made.exit_code, 2) << made.err;
  }
  static void TearDownTestSuite() { delete folder_; }
  static test::ProgramRun replay(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "replay");
    return test::run_program(test::program("knuckle"), std::move(arguments));
  }
  /// A copy that ends at this share of the session.
  static std::string cut_at(double share) {
    const std::string cut = folder_->file("cut.mcap");
    std::filesystem::copy_file(session_, cut, std::filesystem::copy_options::overwrite_existing);
    const auto bytes = static_cast<double>(std::filesystem::file_size(cut));
    std::filesystem::resize_file(cut, static_cast<std::uintmax_t>(share * bytes));
    return cut;
  }
  static inline test::TemporaryFolder* folder_ = nullptr;
  static inline std::string session_;
};

TEST_F(ReplayCommand, SaysInOneLineThatARecordingIsCutOffAsExplainAndExportDoAndFails) {
  const std::string cut = cut_at(0.6);
  const std::vector<std::vector<std::string>> commands{
      {"replay", cut}, {"explain", cut}, {"export", cut, "--side", "machine", "--csv", folder_->file("cut.csv")}};
  for (const std::vector<std::string>& arguments : commands) {
    const auto run = test::run_program(test::program("knuckle"), arguments);
    EXPECT_EQ(run.err.find("knuckle " + arguments.front() + ": " + cut + ": "), 0U) << run.err;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    EXPECT_NE(run.err.find("cut off"), std::string::npos) << run.err;
  }
  EXPECT_EQ(replay({cut}).exit_code, 1);
  EXPECT_EQ(replay({cut, "--with", "solar015"}).exit_code, 1) << "also with another machine";
}

TEST_F(ReplayCommand, WithAnotherMachineTellsWhatDiffers) {
  const auto run = replay({session_, "--with", "compact080"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find(" -> "), std::string::npos) << run.out;
}

/// Numbers of the table's row of one model: share of steps answered, then median and p95 of each difference.
std::vector<double> row_of(const std::string& out, const std::string& model) {
  std::vector<double> numbers;
  const std::size_t at = out.find("  " + model);
  if (at == std::string::npos) return numbers;
  std::istringstream line(out.substr(at + 2 + model.size(), out.find('\n', at) - at - 2 - model.size()));
  for (std::string word; line >> word;)
    if (word != "%") numbers.push_back(std::stod(word));
  return numbers;
}

/// |estimated - true| of a session's table, as its columns tell it.
std::vector<double> off_truth_N(const std::string& csv) {
  std::ifstream in(csv);
  std::map<std::string, std::size_t> columns;
  std::vector<double> off_N;
  for (std::string line; std::getline(in, line);) {
    std::istringstream cells(line);
    std::vector<std::string> row;
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
    if (columns.empty()) {
      for (std::size_t i = 0; i < row.size(); ++i) columns[row[i]] = i;
      continue;
    }
    const auto number = [&](const char* name) { return std::stod(row.at(columns.at(name))); };
    if (number("measured") == 0) continue;
    off_N.push_back(std::hypot(number("tip_force_x_N") - number("truth_tip_force_x_N"),
                               number("tip_force_z_N") - number("truth_tip_force_z_N")));
  }
  return off_N;
}

TEST_F(ReplayCommand, WithAnotherContactModelComparesTheForcesOfTheTwo) {
  const std::string press = folder_->file("press.mcap"), csv = folder_->file("press.csv");
  const auto made = test::run_program(
      test::program("knuckle"), {"simulate", "--scenario", test::source_dir() + "/tests/recordings_replayed/press.toml",
                                 "--log", press, "--csv", csv});
  ASSERT_NE(made.exit_code, 2) << made.err;
  const auto run = replay({press, "--contact-model", "force_and_position", "--true-force", csv});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const std::vector<double> recorded = row_of(run.out, "bucket_force, recorded"),
                            replayed = row_of(run.out, "force_and_position, replayed");
  ASSERT_EQ(recorded.size(), 7U) << run.out;
  ASSERT_EQ(replayed.size(), 7U) << run.out;
  EXPECT_EQ(recorded[0], 100);
  EXPECT_GT(replayed[0], 10);
  EXPECT_LT(replayed[0], 100) << "it has no direction before the first motion";
  EXPECT_GT(replayed[2], 10) << "what is across the direction it does not tell";
  const std::vector<double> off_N = off_truth_N(csv);
  EXPECT_NEAR(recorded[3], median(off_N), 0.06);
  EXPECT_NEAR(recorded[4], quantile(off_N, 0.95), 0.06);
  EXPECT_NE(recorded[4], replayed[4]);

  const auto same = replay({press, "--contact-model", "bucket_force"});
  EXPECT_EQ(row_of(same.out, "bucket_force, replayed"), (std::vector<double>{100, 0, 0})) << same.out;
  EXPECT_EQ(replay({press}).out.find("contact model"), std::string::npos);
  EXPECT_EQ(replay({session_, "--contact-model", "tip_wrench", "--true-force", csv}).exit_code, 2)
      << "the table is of another session";
  EXPECT_EQ(replay({press, "--true-force", csv}).exit_code, 2);
}

}  // namespace
}  // namespace knuckle::cli
