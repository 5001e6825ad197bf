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

namespace knuckle::test {
namespace {
namespace fs = std::filesystem;

const fs::path kConfig = fs::path(test::source_dir()) / "config";

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A folder of its own for each test, gone afterwards.
class Program : public testing::Test {
 protected:
  Program() {
    std::string name = (fs::temp_directory_path() / "knuckle_cli_XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~Program() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }
  [[nodiscard]] std::vector<std::string> left_behind() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_)) names.push_back(entry.path().filename().string());
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
    std::ofstream(copy) << with_match_replaced(text_of(kConfig / file), pattern, to);
    return copy;
  }

  fs::path folder_;
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

TEST_F(Program, TableNamesItsUnits) {
  EXPECT_LE(simulate(brief({"--csv", path("table.csv")})).exit_code, 1);
  std::ifstream table(path("table.csv"));
  std::string header, row;
  std::getline(table, header);
  for (const char* column : {"time_s,", "boom_rad,", "boom_head_Pa,", "tip_force_x_N,", "truth_tip_x_m,",
                             "hand_felt_z_N,", "operator_round_trip_s,"})
    EXPECT_NE((header + ",").find(column), std::string::npos) << column;
  const auto columns = std::count(header.begin(), header.end(), ',');
  int rows = 0;
  for (; std::getline(table, row); ++rows) ASSERT_EQ(std::count(row.begin(), row.end(), ','), columns) << rows;
  EXPECT_EQ(rows, 400);  // 2 s at 200 Hz
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

TEST_F(Program, TsharkFindsNoMalformedFrame) {
  const ProgramRun version = run_program("tshark", {"--version"});
  if (version.exit_code != 0) GTEST_SKIP() << "tshark is not installed";
  EXPECT_LE(simulate({"--scenario", "link_faults", "--duration", "12", "--candump", path("bus.log")}).exit_code, 1);
  const auto frames_that = [&](const std::string& filter) {
    const ProgramRun run = run_program("tshark", {"-r", path("bus.log"), "-d", "can.subdissector,canopen", "-Y", filter,
                                                  "-T", "fields", "-e", "frame.number"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return std::count(run.out.begin(), run.out.end(), '\n');
  };
  EXPECT_EQ(frames_that("_ws.malformed"), 0);
  EXPECT_GT(frames_that("canopen"), 10000);
}

TEST_F(Program, RealTimeRunEndsAndSaysWhatItWasGranted) {
  const ProgramRun run = simulate(brief({"--realtime", "--json", path("rt.json")}));
  EXPECT_LE(run.exit_code, 1) << run.err;
  const auto json = nlohmann::json::parse(text_of(path("rt.json")));
  ASSERT_TRUE(json.at("realtime").is_object());
  for (const char* loop : {"master", "slave"}) {
    const auto& timing = json.at("realtime").at(loop);
    EXPECT_EQ(timing.at("policy").get<std::string>().rfind("SCHED_", 0), 0u) << timing.at("policy");
    for (const char* key : {"wake_us", "execution_us"}) {
      EXPECT_GE(timing.at(key).at("max"), timing.at(key).at("p50")) << loop << ' ' << key;
    }
    EXPECT_TRUE(timing.at("overruns").is_number_unsigned());
  }
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

TEST_F(ProgramRefuses, MachineFilesThatAreNotSound) {
  const std::string file = "machines/solar015.toml";
  const auto machine = [&](const char* from, const char* to, std::vector<std::string> named) {
    SCOPED_TRACE(to);
    named.emplace_back("solar015.toml");
    expect({{"--machine", changed(file, from, to)}, named});
  };
  machine("pump_flow_Lpm = \\S+", "pump_flow_Lpm = 32\npump_colour = 3", {"pump_colour", "unknown"});
  machine("min_length_m = \\S+", "min_length_m = 0.9", {"cylinders.boom"});  // does not reach the working range
  machine("rocker_length_m = \\S+", "rocker_length_m = 0.02", {"bucket"});   // the four-bar does not close
  machine("id = 0x11", "id = 0x10", {"0x10"});                               // two nodes, one number
  machine("name = ", "name = = ", {});
}

TEST_F(ProgramRefuses, ScenariosThatCannotBe) {
  const std::string file = "scenarios/wall_contact.toml";
  const auto scenario = [&](const std::string& from, const std::string& to, std::vector<std::string> named) {
    SCOPED_TRACE(to);
    named.emplace_back("wall_contact.toml");
    expect({{"--scenario", changed(file, from, to)}, named});
  };
  scenario("stiffness_N_per_m", "stiffness", {"stiffness"});
  scenario("metric = \"hold_error_N\"", "metric = \"holt_error\"", {"holt_error"});
  scenario("tip_m = \\[[^\\]]*\\]", "tip_m = [9, 0.1]", {"approach", "range"});
  expect({{"--scenario", "walk"}, {"walk", "wall_contact"}});
  expect({{"--scenario", path("none.toml")}, {"none.toml"}});
}

TEST_F(ProgramRefuses, FilesThatAreMadeToHurt) {
  const auto each = [&](const std::string& text, const std::vector<std::string>& named) {
    SCOPED_TRACE(text.substr(0, 20));
    std::ofstream(path("a.toml"), std::ios::binary) << text;
    expect_of_each_loader(path("a.toml"), named);
  };
  const auto repeated = [](const std::string& what, int times) {
    std::string all;
    for (int i = 0; i < times; ++i) all += what;
    return all;
  };
  const std::vector<std::string> many_names{"a.toml:1: key '" + repeated("a.", 30) + "... (79999 characters)'",
                                            "at most 16 names"};
  const std::vector<std::string> nested{"a.toml:1: ", "must be at most 16 deep"};
  each(repeated("a.", 39'999) + "a = 1", many_names);
  each("a = " + repeated("[", 40'000), nested);
  each(std::string(900'000, 'k') + " = '" + std::string(90'000, 'v') + "'", {"a.toml:1: "});
  each("\"\\u001b[31m\" = 1\nx = '\x1b[31m'", {"a.toml:2: "});
  each("x = '\xff'", {"a.toml:1: "});
  each(std::string(10'000'000, 'k') + " = 1", {"a.toml: must be at most 1 MB"});
}

TEST_F(ProgramRefuses, FilesThatCannotBeReached) {
  fs::create_symlink(path("a.toml"), path("b.toml"));
  fs::create_symlink(path("b.toml"), path("a.toml"));
  expect_of_each_loader(path("a.toml"), {"a.toml", "Too many levels of symbolic links"});
  expect_of_each_loader(path(std::string(300, 'n') + ".toml"), {"nnn.toml", "File name too long"});
  expect_of_each_loader(path("\x1b[31m\xff.toml"), {"\\x1b[31m\\xff.toml", "must be UTF-8 without control characters"});
}

TEST_F(ProgramRefuses, OptionsThatCannotBe) {
  const Refusal table[] = {
      {{"--delay-ms", "-1"}, {"--delay-ms", "-1", "5000"}},
      {{"--loss", "2"}, {"--loss", "from 0 to 1"}},
      {{"--control", "telepathy"}, {"--control", "telepathy", "echo"}},
      {{"--machine", "solar016"}, {"solar016", "solar015"}},
      {{"--device", "knuckle9"}, {"knuckle9", "knuckle1"}},
      {{"--operator", "nobody"}, {"--operator", "nobody", "relaxed", "path:FILE.mcap"}},
      {{"--operator", "path:nosuch.csv"}, {"--operator nosuch.csv: no such file"}},
      {{"--realtime", "--delay-ms", "10"}, {"--delay-ms", "--realtime"}},
      {{"--scenario", "recorded_dig"}, {"recorded_dig", "--operator"}},
      {{"--json", "-", "--candump", "-"}, {"--json", "--candump"}},
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
TEST_F(ProgramRefuses, OutputsThatWouldReplaceAPrivateKeyPairingsOrAnAuditTrail) {
  std::ofstream(path("key.pem")) << "mine";
  fs::create_symlink(path("key.pem"), path("link.csv"));
  for (const std::string file : {"key.pem", "link.csv", "new/key.pem"})
    expect({{"--json", path(file)}, {"--json", file, "private key"}});
  for (const std::string file : {"audit-000001.jsonl", "head"})
    expect({{"--json", path(file)}, {"--json", file, "audit trail"}});
  for (const std::string file : {"peers.toml", "turn.toml"})
    expect({{"--json", path(file)}, {"--json", file, "pairings"}});
  const ProgramRun commission = run_program(
      test::program("knuckle"), {"commission", "--simulate", "--machine", "solar015", "--out", path("peers.toml")});
  EXPECT_EQ(commission.exit_code, 2);
  EXPECT_NE(commission.err.find("peers.toml: is named like a file of the pairings"), std::string::npos)
      << commission.err;
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
