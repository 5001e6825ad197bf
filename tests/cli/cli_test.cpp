// The program from outside: exit codes, what it writes and where, and one clear line for everything it cannot do.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/text.h"
#include "tests/support/candump.h"
#include "tests/support/patterns.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/says.h"
#include "tests/support/stalled_pipe.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {
namespace {
namespace fs = std::filesystem;

const fs::path kConfig = fs::path(test::source_dir()) / "config";

/// A folder of its own for each test, gone afterwards.
class Program : public testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const { return folder_.file(name); }
  [[nodiscard]] std::vector<std::string> left_behind() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_.path())) names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
  }
  static ProgramRun simulate(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "simulate");
    return run_program(test::program("knuckle"), std::move(arguments));
  }
  /// A copy of a configuration file with the first match of a pattern exchanged.
  [[nodiscard]] std::string changed(const std::string& file, const std::string& pattern, const std::string& to) const {
    const std::string copy = path(fs::path(file).filename().string());
    std::ofstream(copy) << with_match_replaced(content((kConfig / file).string()), pattern, to);
    return copy;
  }

  TemporaryFolder folder_;
};

TEST_F(Program, ExitCodeSaysWhetherWhatDecidesWasMet) {
  const std::string missing = changed("scenarios/free_motion.toml", "\\[\\[requirement\\]\\]",
                                      "[[requirement]]\nmetric = \"engaged_s\"\nmin = 1e6\n\n[[requirement]]");
  const ProgramRun missed = simulate({"--scenario", missing});
  EXPECT_EQ(missed.exit_code, 1);
  EXPECT_NE(missed.out.find("\nNOT passed: "), std::string::npos) << missed.out;
  EXPECT_EQ(simulate({"--scenario", missing, "--delay-ms", "2"}).exit_code, 0) << "it does not decide then";
  EXPECT_EQ(simulate({"--scenario", missing, "--delay-ms", "2", "--judge"}).exit_code, 1);
  const std::string brief = path("press.toml");
  std::ofstream(brief) << content(test::source_dir() + "/tests/recordings_replayed/press.toml")
                       << "\n[[requirement]]\nmetric = \"engaged_s\"\nmin = 0.1\n";
  const ProgramRun met = simulate({"--scenario", brief, "--judge"});
  EXPECT_EQ(met.exit_code, 0) << met.out << met.err;
  EXPECT_TRUE(says(met.out, "\npassed: 1 of 1 requirement met\n"));
  EXPECT_EQ(run_program(test::program("knuckle"), {}).exit_code, 0);
}

TEST_F(Program, ASessionThatWasCutShortIsNotJudgedAndItsTableAndCandumpHoldAllOfIt) {
  const ProgramRun run =
      simulate({"--scenario", "free_motion", "--duration", "2", "--csv", path("a.csv"), "--candump", path("bus.log")});
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_NE(run.out.find("\nended by --duration: not judged\n"), std::string::npos);
  EXPECT_EQ(run.err, "");  // quiet in a pipe
  std::ifstream table(path("a.csv"));
  std::string line;
  std::vector<double> times_s;
  std::getline(table, line);
  EXPECT_EQ(line.rfind("time_s,", 0), 0U) << line;
  while (std::getline(table, line)) times_s.push_back(std::stod(line));
  ASSERT_EQ(times_s.size(), 400U) << "2 s at 200 Hz";
  for (std::size_t i = 1; i < times_s.size(); ++i) ASSERT_NEAR(times_s[i] - times_s[i - 1], 0.005, 1e-9) << i;
  std::ifstream log(path("bus.log"));
  std::map<unsigned, int> count;
  for (const WireFrame& f : read_candump(log)) ++count[f.id];
  EXPECT_NEAR(count[0x080], 400, 5) << "SYNC";
  EXPECT_NEAR(count[0x701], 40, 3) << "heartbeat of the controller";
  for (const unsigned node : {0x10U, 0x11U, 0x12U}) EXPECT_GT(count[0x180 + node], 80) << "valve " << node;
  for (const unsigned node : {0x20U, 0x25U, 0x30U, 0x32U}) EXPECT_GT(count[0x180 + node], 300) << "sensor " << node;
  EXPECT_GT(count[0x1B8], 150) << "tilt";
  EXPECT_GT(count[0x210], 100) << "set-points";
}

TEST_F(Program, InRealTimeTheResultSaysHowTheLoopsRan) {
  const ProgramRun run = simulate({"--scenario", "free_motion", "--duration", "1", "--realtime", "--json", "-"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto json = nlohmann::json::parse(run.out);
  EXPECT_GE(json.at("timing").at("simulated_s"), 1);
  for (const char* loop : {"slave", "master"}) EXPECT_TRUE(json.at("realtime").at(loop).contains("wake_us")) << loop;
}

/// Exit 2, one line on standard error that a terminal does not obey, nothing on standard output, nothing half-written.
TEST_F(Program, RefusesInOneLineAndLeavesEverythingAsItWas) {
  fs::create_symlink(path("a.toml"), path("b.toml"));
  fs::create_symlink(path("b.toml"), path("a.toml"));
  const std::vector<std::string> before = left_behind();
  const std::string simulate = "simulate", sweep = "sweep";
  const std::pair<std::vector<std::string>, const char*> table[] = {
      {{simulate, "--scenario", path("a.toml")}, "Too many levels of symbolic links"},
      {{simulate, "--scenario", path(std::string(300, 'n') + ".toml")}, "File name too long"},
      {{simulate, "--machine", path("\x1b[31m\xff.toml")}, "\\x1b[31m\\xff.toml': must be UTF-8"},
      {{simulate, "--machine", "solar016"}, "solar015"},
      {{simulate, "--json", path("key.pem")}, "key.pem: is named like a computer's private key"},
      {{simulate, "--json", path("head")}, "head: is named like a file of an audit trail"},
      {{"commission", "--simulate", "--machine", "solar015", "--out", path("peers.toml")},
       "peers.toml: is named like a file of the pairings"},
      {{"swep"}, "unknown command 'swep'"},
      {{sweep}, "--battery is required"},
      {{sweep, "--battery", "forces"}, "estimation"},
      {{sweep, "--battery", "estimation", "--ablation", ""}, "--ablation \"\": must"},
      {{sweep, "--battery", "estimation", "--machine", "solar016"}, "solar015"},
      {{sweep, "--battery", "estimation", "--json", path("key.pem")}, "key.pem: is named like"},
      {{sweep, "--battery", "estimation", "--json", path("audit-000001.jsonl")}, "audit-000001.jsonl: is named like"},
  };
  for (const auto& [arguments, said] : table) {
    const char* const name = arguments[0].starts_with("sw") ? "knuckle-studies" : "knuckle";
    const ProgramRun run = run_program(test::program(name), arguments);
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_EQ(run.out, "");
    EXPECT_EQ(printable(run.err), run.err.substr(0, run.err.find('\n')) + "\\x0a") << "a terminal would obey it";
    EXPECT_TRUE(says(run.err, said));
    EXPECT_EQ(left_behind(), before);
  }
}

TEST_F(Program, SaysThatItsSummaryIsLost) {
  const ProgramRun full = run_program("/bin/sh", {"-c", test::program("knuckle") + " --help > /dev/full"});
  EXPECT_EQ(full.exit_code, 2);
  EXPECT_EQ(full.err, "knuckle: standard output: cannot be written\n");
  // Somebody who reads no more, or never did, has lost nothing.
  StalledPipe pipe;
  pipe.leave();
  for (const std::string closed : {"", " >&-"}) {
    RunningProgram program("/bin/sh", {"-c", "trap '' PIPE; " + test::program("knuckle") + " --help" + closed},
                           pipe.writing_end());
    const ProgramRun run = program.wait();
    EXPECT_EQ(run.exit_code, 0) << closed;
    EXPECT_EQ(run.err, "") << closed;
  }
}

TEST_F(Program, TakesEveryNameOfStandardOutputForTheSame) {
  const std::string run =
      test::program("knuckle") + " simulate --scenario free_motion --duration 1 --json /dev/stdout ";
  for (const std::string& where : {std::string(" | cat"), " > " + path("a.json") + "; cat " + path("a.json")}) {
    const ProgramRun shown = run_program("/bin/sh", {"-c", run + where});
    const auto json = nlohmann::json::parse(shown.out);
    EXPECT_EQ(json.at("schema"), "knuckle-session/2") << where;
    EXPECT_TRUE(json.at("passed").is_null()) << where;
    EXPECT_NE(shown.err.find("not judged"), std::string::npos) << where;
  }
}

}  // namespace
}  // namespace knuckle::test
