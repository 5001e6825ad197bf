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

const std::vector<std::string> kShort{"--scenario", "free_motion", "--duration", "2"};

std::vector<std::string> brief(std::initializer_list<std::string> more) {
  std::vector<std::string> all = kShort;
  all.insert(all.end(), more);
  return all;
}

TEST_F(Program, ExitCodeSaysWhetherWhatDecidesWasMet) {
  const ProgramRun met = simulate({"--scenario", "link_faults"});
  EXPECT_EQ(met.exit_code, 0) << met.out << met.err;
  EXPECT_NE(met.out.find("\npassed: "), std::string::npos) << met.out;
  const std::string missing = changed("scenarios/free_motion.toml", "\\[\\[requirement\\]\\]",
                                      "[[requirement]]\nmetric = \"engaged_s\"\nmin = 1e6\n\n[[requirement]]");
  const ProgramRun missed = simulate({"--scenario", missing});
  EXPECT_EQ(missed.exit_code, 1);
  EXPECT_NE(missed.out.find("\nNOT passed: "), std::string::npos) << missed.out;
  EXPECT_EQ(simulate({"--scenario", missing, "--delay-ms", "2"}).exit_code, 0) << "it does not decide then";
  EXPECT_EQ(simulate({"--scenario", missing, "--delay-ms", "2", "--judge"}).exit_code, 1);
  const ProgramRun cut = simulate(kShort);
  EXPECT_EQ(cut.exit_code, 0) << cut.out << cut.err;
  EXPECT_NE(cut.out.find("\nended by --duration: not judged\n"), std::string::npos);
  EXPECT_EQ(cut.err, "");  // quiet in a pipe
  EXPECT_EQ(run_program(test::program("knuckle"), {"--help"}).exit_code, 0);
  EXPECT_EQ(run_program(test::program("knuckle"), {}).exit_code, 0);
}

TEST_F(Program, InterruptedItLeavesNothingBehind) {
  const ProgramRun run = run_program(
      test::program("knuckle"),
      {"simulate", "--realtime", "--scenario", "free_motion", "--json", path("a.json"), "--csv", path("a.csv")},
      std::chrono::milliseconds(1500));
  EXPECT_EQ(run.exit_code, 130) << run.out << run.err;
  EXPECT_TRUE(left_behind().empty());
}

TEST_F(Program, JsonOnStandardOutputIsAloneThere) {
  const ProgramRun run = simulate(brief({"--json", "-"}));
  const auto json = nlohmann::json::parse(run.out);
  EXPECT_EQ(json.at("schema"), "knuckle-session/2");
  EXPECT_TRUE(json.at("passed").is_null());
  EXPECT_NE(run.err.find("not judged"), std::string::npos);  // the summary made room
}

TEST_F(Program, TheTableHasARowForEachStepOfTheMachinesSideOneAfterTheOther) {
  EXPECT_EQ(simulate(brief({"--csv", path("a.csv")})).exit_code, 0);
  std::ifstream table(path("a.csv"));
  std::string line;
  std::vector<double> times_s;
  std::getline(table, line);
  EXPECT_EQ(line.rfind("time_s,", 0), 0U) << line;
  while (std::getline(table, line)) times_s.push_back(std::stod(line));
  ASSERT_EQ(times_s.size(), 400U) << "2 s at 200 Hz";
  for (std::size_t i = 1; i < times_s.size(); ++i) ASSERT_NEAR(times_s[i] - times_s[i - 1], 0.005, 1e-9) << i;
}

TEST_F(Program, InRealTimeTheResultSaysHowTheLoopsRan) {
  const ProgramRun run = simulate(brief({"--realtime", "--json", "-"}));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto json = nlohmann::json::parse(run.out);
  EXPECT_EQ(json.at("schema"), "knuckle-session/2");
  EXPECT_GE(json.at("timing").at("simulated_s"), 2);
  for (const char* loop : {"slave", "master"}) EXPECT_TRUE(json.at("realtime").at(loop).contains("wake_us")) << loop;
}

TEST_F(Program, CandumpHoldsTheWholeBus) {
  EXPECT_LE(simulate(brief({"--candump", path("bus.log")})).exit_code, 1);
  std::ifstream log(path("bus.log"));
  std::vector<WireFrame> frames;
  ASSERT_NO_THROW(frames = read_candump(log));
  std::map<unsigned, int> count;
  for (const WireFrame& f : frames) ++count[f.id];
  EXPECT_NEAR(count[0x080], 400, 5) << "SYNC";
  EXPECT_NEAR(count[0x701], 40, 3) << "heartbeat of the controller";
  for (const unsigned node : {0x10U, 0x11U, 0x12U}) EXPECT_GT(count[0x180 + node], 80) << "valve " << node;
  for (const unsigned node : {0x20U, 0x25U, 0x30U, 0x32U}) EXPECT_GT(count[0x180 + node], 300) << "sensor " << node;
  EXPECT_GT(count[0x1B8], 150) << "tilt";
  EXPECT_GT(count[0x210], 100) << "set-points";
}

struct Refusal {
  std::vector<std::string> arguments;
  std::vector<std::string> named;  ///< What the line must contain.
};

class ProgramRefuses : public Program {
 protected:
  /// Exit 2, one line on standard error with all the words, nothing on standard output, nothing half-written.
  void expect(const Refusal& refusal) {
    const std::vector<std::string> before = left_behind();
    std::vector<std::string> arguments = refusal.arguments;
    arguments.insert(arguments.end(), {"--csv", path("out.csv"), "--duration", "1"});
    const ProgramRun run = simulate(arguments);
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_EQ(run.out, "");
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    EXPECT_EQ(printable(run.err), run.err.substr(0, run.err.find('\n')) + "\\x0a") << "a terminal would obey it";
    EXPECT_LT(run.err.size(), 4200U);
    for (const std::string& word : refusal.named)
      EXPECT_NE(run.err.find(word), std::string::npos) << run.err << "lacks " << word;
    EXPECT_EQ(left_behind(), before);
  }

  /// The file given with every option that reads TOML.
  void expect_of_each_loader(const std::string& file, const std::vector<std::string>& named) {
    const std::string path_file = path("motion.csv");
    std::ofstream(path_file) << "t\n1\n";
    for (const std::vector<std::string>& arguments : {std::vector<std::string>{"--machine", file},
                                                      {"--scenario", file},
                                                      {"--device", file},
                                                      {"--truth", file},
                                                      {"--operator", "path:" + path_file, "--map", file}}) {
      SCOPED_TRACE(arguments.front());
      expect({arguments, named});
    }
  }
};

TEST_F(ProgramRefuses, FilesThatCannotBeReached) {
  fs::create_symlink(path("a.toml"), path("b.toml"));
  fs::create_symlink(path("b.toml"), path("a.toml"));
  expect_of_each_loader(path("a.toml"), {"a.toml", "Too many levels of symbolic links"});
  expect_of_each_loader(path(std::string(300, 'n') + ".toml"), {"nnn.toml", "File name too long"});
  expect_of_each_loader(path("\x1b[31m\xff.toml"), {"\\x1b[31m\\xff.toml", "must be UTF-8 without control characters"});
}

TEST_F(ProgramRefuses, OptionsThatCannotBe) {
  const Refusal table[] = {
      {{"--control", "telepathy"}, {"--control", "telepathy", "echo"}},
      {{"--machine", "solar016"}, {"solar016", "solar015"}},
      {{"--device", "knuckle9"}, {"knuckle9", "knuckle1"}},
      {{"--operator", "nobody"}, {"--operator", "nobody", "relaxed", "path:FILE.mcap"}},
      {{"--operator", "path:nosuch.csv"}, {"--operator nosuch.csv: no such file"}},
      {{"--realtime", "--delay-ms", "10"}, {"--delay-ms", "--realtime"}},
      {{"--scenario", "recorded_dig"}, {"recorded_dig", "--operator"}},
  };
  for (const Refusal& refusal : table) {
    SCOPED_TRACE(refusal.arguments.front());
    expect(refusal);
  }
}

/// Each in one line, exit 2, before any work and without a trace.
TEST_F(ProgramRefuses, SweepsThatCannotBe) {
  std::ofstream(path("file")) << "mine";
  const std::vector<std::string> sweep{"sweep", "--battery", "estimation", "--machines", "1"};
  const std::vector<std::pair<std::vector<std::string>, Refusal>> table{
      {{"swep"}, {{}, {"unknown command 'swep'", "sweep", "operators"}}},
      {{"sweep"}, {{}, {"--battery is required", "knuckle-studies sweep --help"}}},
      {{"sweep", "--battery", "forces"}, {{}, {"--battery", "forces", "estimation"}}},
      {sweep, {{"--ensemble", "1"}, {"--ensemble 1: must be a whole number from 2 to 10000 machines, or 0: none"}}},
      {sweep, {{"--ablation", ""}, {"--ablation \"\": must be"}}},
      {sweep, {{"--machine", "solar016"}, {"solar016", "solar015"}}},
      {sweep, {{"--machine", path("file"), "--json", path("file")}, {"--json", "already taken by --machine"}}},
      {sweep, {{"--json", path("file/a")}, {"--json", "file/a"}}},
  };
  const std::vector<std::string> before = left_behind();
  for (auto [arguments, refusal] : table) {
    arguments.insert(arguments.end(), refusal.arguments.begin(), refusal.arguments.end());
    const ProgramRun run = run_program(test::program("knuckle-studies"), arguments);
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_EQ(run.out, "");
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    for (const std::string& word : refusal.named)
      EXPECT_NE(run.err.find(word), std::string::npos) << run.err << "lacks " << word;
  }
  EXPECT_EQ(left_behind(), before);
}

TEST_F(ProgramRefuses, OutputsThatCannotBeWritten) {
  std::ofstream(path("file")) << "mine";
  expect({{"--json", path("file/a.json")}, {"--json", "file/a.json"}});
  fs::create_directory(path("folder"));
  expect({{"--json", path("folder")}, {"--json", "folder", "directory"}});
  expect({{"--report", "/proc/a.html"}, {"--report", "/proc/a.html"}});
  expect({{"--candump", path("out.csv")}, {"--candump", "--csv"}});
  expect(
      {{"--json", "-", "--report", "/dev/stdout"}, {"--json", "--report", "only one output can be standard output"}});
}

// A configuration file may be one that no option names: the device's, by default.
TEST_F(ProgramRefuses, OutputsThatWouldReplaceConfiguration) {
  std::ofstream(path("device.toml")) << "mine";
  fs::create_symlink(path("device.toml"), path("link.csv"));
  for (const std::string file : {"device.toml", "link.csv", "new.toml"})
    expect({{"--json", path(file)}, {"--json", file, "configuration file"}});
}

// Whatever the folder: nobody has to say where keys and trails are for them to be kept.
TEST_F(ProgramRefuses, OutputsThatWouldReplaceAPrivateKeyOrAnAuditTrail) {
  std::ofstream(path("key.pem")) << "mine";
  fs::create_symlink(path("key.pem"), path("link.csv"));
  for (const std::string file : {"link.csv", "new/key.pem"})
    expect({{"--json", path(file)}, {"--json", file, "private key"}});
  expect({{"--json", path("head")}, {"--json", "head", "audit trail"}});
  const ProgramRun commission = run_program(
      test::program("knuckle"), {"commission", "--simulate", "--machine", "solar015", "--out", path("peers.toml")});
  EXPECT_EQ(commission.exit_code, 2);
  EXPECT_NE(commission.err.find("peers.toml: is named like a file of the pairings"), std::string::npos)
      << commission.err;
  for (const std::string file : {"key.pem", "audit-000001.jsonl"}) {
    const ProgramRun sweep = run_program(test::program("knuckle-studies"),
                                         {"sweep", "--battery", "work", "--sessions", "1", "--json", path(file)});
    EXPECT_EQ(sweep.exit_code, 2) << sweep.out << sweep.err;
    EXPECT_NE(sweep.err.find(file + ": is named like"), std::string::npos) << sweep.err;
  }
}

TEST_F(ProgramRefuses, OutputsThatWouldReplaceAKeyATrailOrARecordingOfAnotherName) {
  struct Case {
    const char *content, *why;
  };
  for (const Case& c : std::initializer_list<Case>{
           {"-----BEGIN PRIVATE KEY-----\nMC4C\n", "holds a private key"},
           {"-----BEGIN CERTIFICATE-----\nMC4C\n-----END CERTIFICATE-----\n-----BEGIN EC PRIVATE KEY-----\n",
            "holds a private key"},
           {"{\"n\":1,\"utc\":\"2026-11-21T05:00:00.000Z\",\"mono_s\":1.5,\"event\":\"file\",\"before\":\"00\"}\n",
            "holds an audit trail"},
           {"\x89MCAP0\r\n\x01", "holds a recording"}}) {
    std::ofstream(path("mine.bin")) << c.content;
    expect({{"--json", path("mine.bin")}, {"--json", "mine.bin", c.why}});
    EXPECT_EQ(content(path("mine.bin")), c.content);
  }
}

TEST_F(Program, SaysThatItsSummaryIsLost) {
  for (const std::string arguments : {"--help", "simulate --scenario free_motion --duration 0.1"}) {
    const ProgramRun run = run_program("/bin/sh", {"-c", test::program("knuckle") + " " + arguments + " > /dev/full"});
    EXPECT_EQ(run.exit_code, 2) << arguments;
    EXPECT_EQ(run.err, "knuckle: standard output: cannot be written\n") << arguments;
  }
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
    EXPECT_EQ(nlohmann::json::parse(shown.out).at("schema"), "knuckle-session/2") << where;
    EXPECT_NE(shown.err.find("not judged"), std::string::npos) << where;
  }
}

}  // namespace
}  // namespace knuckle::test
