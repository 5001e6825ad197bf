// Ctrl+C while a command reads or writes for long: one line, exit code 130, nothing left behind.
#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::cli {
namespace {

class InterruptedProgram : public testing::Test {
 protected:
  static void expect_ends(const std::vector<std::string>& arguments) {
    test::RunningProgram program(test::program("knuckle"), arguments);
    EXPECT_TRUE(program.interrupt_when_it_listens()) << arguments.front() << " does not note the signal";
    const test::ProgramRun run = program.wait();
    EXPECT_EQ(run.exit_code, 130) << run.err;
    EXPECT_EQ(run.out, "");
    EXPECT_EQ(run.err, "knuckle: interrupted; nothing was written\n");
  }
  /// Of a session that takes a second to be read, at least.
  [[nodiscard]] std::string recording() const {
    const std::string file = folder_.file("long.mcap");
    const auto made = test::run_program(test::program("knuckle"),
                                        {"simulate", "--scenario", "wall_contact", "--duration", "20", "--log", file});
    EXPECT_NE(made.exit_code, 2) << made.err;
    return file;
  }
  test::TemporaryFolder folder_;
};

TEST_F(InterruptedProgram, ReplayAndExplainSayOneLine) {
  const std::string file = recording();
  expect_ends({"replay", file});
  expect_ends({"explain", file, "--json", folder_.file("out.json")});
  EXPECT_EQ(folder_.count(), 1);
}

TEST_F(InterruptedProgram, ImportSaysOneLineAndLeavesNothingBehind) {
  constexpr int kRows = 300'000;
  std::ofstream table(folder_.file("table.csv"));
  table << "time_s,boom_head_Pa,boom_rod_Pa,arm_head_Pa,arm_rod_Pa,bucket_head_Pa,bucket_rod_Pa,boom_cylinder_m,"
           "arm_cylinder_m,bucket_cylinder_m,hull_pitch_rad\n";
  for (int i = 0; i < kRows; ++i) table << 0.005 * i << ',' << 5e6 + i << ",1e6,1e6,1e6,1e6,1e6,1.1,1.1,0.9,0\n";
  table.close();
  expect_ends({"import", folder_.file("table.csv"), "--machine", "solar015", "--out", folder_.file("out.mcap")});
  EXPECT_EQ(folder_.count(), 1);
}

}  // namespace
}  // namespace knuckle::cli
