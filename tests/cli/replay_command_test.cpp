// `knuckle replay` as a user runs it, on a short session.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

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

TEST_F(ReplayCommand, FailsWhereNotAllCouldBeReadAlsoWithAnotherMachine) {
  const std::string cut = cut_at(0.6);
  EXPECT_EQ(replay({session_, "--with", "compact080"}).exit_code, 0);
  const auto run = replay({cut, "--with", "solar015"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find("it has no end: its program was killed, or the disk refused the rest\n"), std::string::npos)
      << run.err;
}

TEST_F(ReplayCommand, SaysInOneLineThatARecordingIsCutOffAsExplainAndExportDo) {
  const std::string cut = cut_at(0.6);
  const std::vector<std::vector<std::string>> commands{
      {"replay", cut}, {"explain", cut}, {"export", cut, "--side", "machine", "--csv", folder_->file("cut.csv")}};
  for (const std::vector<std::string>& arguments : commands) {
    const auto run = test::run_program(test::program("knuckle"), arguments);
    EXPECT_EQ(run.err.find("knuckle " + arguments.front() + ": " + cut + ": "), 0U) << run.err;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    EXPECT_NE(run.err.find("cut off"), std::string::npos) << run.err;
  }
}

TEST_F(ReplayCommand, CallsModesAndCodesByTheirNames) {
  const auto run = replay({session_, "--with", "compact080"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find(" -> "), std::string::npos) << run.out;
  for (const char* field : {"  mode ", ".code "}) {
    const std::size_t at = run.out.find(field);
    if (at == std::string::npos) continue;
    EXPECT_NE(run.out.substr(at, run.out.find('\n', at) - at).find(" -> "), std::string::npos) << run.out;
  }
}

TEST_F(ReplayCommand, SaysWhatIsWrongInAMachineFileThatIsCutOff) {
  std::ifstream whole(test::source_dir() + "/config/machines/solar015.toml");
  std::string text{std::istreambuf_iterator<char>(whole), {}};
  const std::string file = folder_->file("cut.toml");
  std::ofstream(file) << text.substr(0, text.find("[cylinders"));
  const auto run = replay({session_, "--with", file});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(run.err.find("knuckle: " + file), 0U) << run.err;
  EXPECT_EQ(run.err.find("device file"), std::string::npos) << run.err;
}

}  // namespace
}  // namespace knuckle::cli
