// `knuckle doctor` and `knuckle commission` from outside: exit codes, files, and one clear line for wrong usage.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>

#include "app/bringup/commission_command.h"
#include "app/bringup/doctor_command.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {
namespace {
namespace fs = std::filesystem;

class HardwareCli : public testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const { return folder_.file(name); }
  /// With these lines on standard input.
  ProgramRun commission(const std::string& lines, const std::string& machine = "solar015",
                        const std::string& more = "") const {
    std::ofstream(path("answers.txt")) << lines;
    return run_program("/bin/sh", {"-c", knuckle::test::program("knuckle") + " commission --simulate --machine " +
                                             machine + " --out " + path("result.toml") + more + " --record " +
                                             folder_.path().string() + " < " + path("answers.txt")});
  }
  TemporaryFolder folder_;
};

TEST_F(HardwareCli, DoctorOfTheSimulatedBusIsWellAndSaysSoToTools) {
  const ProgramRun run =
      run_program(knuckle::test::program("knuckle"),
                  {"doctor", "--simulate", "--machine", "solar015", "--listen", "0.2", "--json", path("d.json")});
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_NE(run.out.find("nothing wrong"), std::string::npos);
  std::ifstream file(path("d.json"));
  const auto json = nlohmann::json::parse(file);
  EXPECT_EQ(json["schema"], "knuckle-doctor/2");
  EXPECT_EQ(json["passed"], true);
  EXPECT_EQ(json["nodes"].size(), 14U);
}

constexpr const char* kCalibration = R"(
[calibration]
method = "survey"
date = "2026-01-01"
data_sha256 = "0000000000000000000000000000000000000000000000000000000000000000"
data_source = "survey.csv"
program = "knuckle"
[calibration.geometry]
length_m = [1.76, 0.95, 0.50]
boom_parent_pin_m = [0.115, -0.225]
boom_child_pin_m = [0.875, 0.257]
arm_parent_pin_m = [0.834, 0.610]
arm_child_pin_m = [-0.214, 0.135]
bucket_cylinder_pin_m = [-0.114436, 0.273280]
bucket_rocker_pin_m = [0.751520, 0]
bucket_pin_m = [-0.011956, 0.140056]
rocker_length_m = 0.204960
coupler_length_m = 0.204960
encoder_offset_mm = [12, -9, 3]
tip_rms_mm = 4
)";

/// The lines of the sensors in the table of nodes: what they read on the simulated machine.
std::vector<std::string> readings(const std::string& told) {
  std::vector<std::string> lines;
  std::istringstream in(told);
  for (std::string line; std::getline(in, line);)
    if (line.rfind("0x2", 0) == 0 || line.rfind("0x3", 0) == 0) lines.push_back(line);
  return lines;
}

TEST_F(HardwareCli, TheSimulatedMachineIsTheSameOneOnceItsFileIsCalibrated) {
  const std::string drawing = knuckle::test::source_dir() + "/config/machines/solar015.toml";
  const std::string file = path("calibrated.toml");
  std::ofstream(file) << std::ifstream(drawing).rdbuf() << kCalibration;
  const auto doctor = [](const std::string& machine) {
    return readings(run_program(knuckle::test::program("knuckle"),
                                {"doctor", "--simulate", "--machine", machine, "--listen", "0.2"})
                        .out);
  };
  ASSERT_EQ(doctor(drawing).size(), 10U);
  EXPECT_EQ(doctor(drawing), doctor(file));
  const auto identity = [this](const std::string& machine) { return readings(commission("ready\n", machine).out); };
  ASSERT_EQ(identity(drawing).size(), 10U);
  EXPECT_EQ(identity(drawing), identity(file));
}

TEST_F(HardwareCli, WrongUsageIsRefusedInOneLine) {
  std::ofstream(path("d.json")) << "mine\n";
  const std::string simulated = "doctor --simulate --machine solar015 ";
  const std::vector<std::pair<std::string, std::string>> cases{
      {"doctor --can nosuch0", "nosuch0"},
      {"doctor --machine solar015", "needs --can"},
      {"doctor --simulate", "needs --machine"},
      {"doctor --device-file knuckle1", "needs --device"},
      {"doctor --listen 1", "needs --can"},
      {"doctor --device hid --bit-rate 250", "needs --can"},
      {"doctor --connect 127.0.0.1", "--connect 127.0.0.1: "},
      {"doctor --connect ::1:5683", "--connect ::1:5683: "},
      {"doctor --connect arm:0", "--connect arm:0: port \"0\" must be a whole number from 1 to 65535"},
      {simulated + "--json " + path("r.toml"), "configuration"},
      {simulated + "--bit-rate 250", "without --machine"},
      {simulated + "--bit-rate 5", "10 to 1000"},
      {"doctor --device hid --device-file " + path("d.json") + " --json " + path("d.json"),
       "already taken by --device-file"},
      {"commission --machine solar015 --out " + path("r.toml"), "needs --can"},
      {"commission --simulate --machine solar015", "--out"},
      {"commission --simulate --machine solar015 --out " + path("r.csv"), "end in .toml"},
      {"commission --can can0 --machine solar015 --out " + path("r.toml") + " --fault e_stop@1",
       "--fault e_stop@1: only goes with --simulate"},
      {"commission --simulate --machine solar015 --out " + path("r.toml") + " --fault guard_dead:tilt@0",
       "--fault guard_dead:tilt@0: "},
      {"commission --simulate --machine solar015 --out " + path("r.toml") + " --fault guard_dead:enable@usr1",
       "--fault guard_dead:enable@usr1: usr1 is for knuckle node: needs seconds here"},
  };
  for (const auto& [line, says] : cases) {
    std::istringstream in(line);
    const std::vector<std::string> arguments{std::istream_iterator<std::string>(in), {}};
    const std::string said = refusal([&, &given = arguments] {
      (void)cli::parse_command_line({"knuckle", "", "", {bringup::doctor_entry(), bringup::commission_entry()}}, given)
          .run();
    });
    EXPECT_NE(said.find(says), std::string::npos) << line << ": " << said;
    EXPECT_EQ(said.find('\n'), std::string::npos) << said;
  }
  EXPECT_FALSE(fs::exists(path("r.toml")));
  EXPECT_EQ(fs::file_size(path("d.json")), 5U);
}

TEST_F(HardwareCli, CommissioningThatEndsEarlyWritesNothing) {
  const ProgramRun run = commission("ready\nconfigure\nno\n");
  EXPECT_EQ(run.exit_code, 1) << run.err;
  EXPECT_NE(run.err.find("machine neutral, nothing written"), std::string::npos) << run.err;
  EXPECT_FALSE(fs::exists(path("result.toml")));
  EXPECT_EQ(folder_.count(), 1);  // the answers alone
}

TEST_F(HardwareCli, ADeadGuardCanBePractisedOnTheSimulatedMachine) {
  const std::string lines = "ready\nconfigure\npressed\nreleased\n0\npilot\nguards\nno\n";
  EXPECT_EQ(commission(lines).out.find("not proved"), std::string::npos);
  const ProgramRun run = commission(lines, "solar015", " --fault guard_dead:arm_valve@0");
  EXPECT_EQ(run.exit_code, 1) << run.err;
  EXPECT_NE((run.out + run.err).find("arm_valve: guard not proved: "), std::string::npos) << run.out << run.err;
}

TEST_F(HardwareCli, CommissioningMakesTheFolderOfItsRecordingsWhereItCan) {
  const auto record = [this](const std::string& folder) {
    return run_program("/bin/sh", {"-c", "echo no | " + knuckle::test::program("knuckle") +
                                             " commission --simulate --machine solar015 --out " + path("r.toml") +
                                             " --record " + folder});
  };
  EXPECT_EQ(record(path("new/one")).exit_code, 1) << "the answer ended it, not the folder";
  EXPECT_FALSE(fs::exists(path("new"))) << "nothing was recorded";
  std::ofstream(path("file")) << "mine\n";
  for (const std::string& folder : {path("file"), path("file/rec"), std::string("-")}) {
    const ProgramRun run = record(folder);
    EXPECT_EQ(run.exit_code, 2) << run.out;
    EXPECT_NE(run.err.find("--record " + folder), std::string::npos) << run.err;
  }
}

TEST_F(HardwareCli, CommissioningWritesOverNoRecording) {
  std::ofstream(path("fast.csv")) << "mine\n";
  const ProgramRun run = commission("ready\n");
  EXPECT_EQ(run.exit_code, 2) << run.out << run.err;
  EXPECT_NE(run.err.find("already contains fast.csv"), std::string::npos) << run.err;
  EXPECT_EQ(std::filesystem::file_size(path("fast.csv")), 5U);
}

TEST_F(HardwareCli, CommissioningThatHasEndedGoesOnWithResumeAndLeavesNoProgressBehindItsResult) {
  std::string lines = "ready\nconfigure\npressed\nreleased\n0\npilot\nguards\nmove\n";
  for (int j = 0; j < 3; ++j) lines += "go\nlonger\ngo\nshorter\n";
  std::string strokes;
  for (int j = 0; j < 3; ++j) strokes += "go\ngo\ngo\ntape\npreset\n";
  const std::string log = " --log " + path("log");
  const ProgramRun ended = commission(lines + strokes + "no\n", "solar015", log);
  EXPECT_EQ(ended.exit_code, 1) << ended.err;
  EXPECT_NE(ended.err.find("with --resume goes on"), std::string::npos) << ended.err;
  EXPECT_NE(ended.out.find("recorded in " + path("log")), std::string::npos) << ended.out;
  EXPECT_TRUE(fs::exists(path("result.toml.progress")));
  EXPECT_FALSE(fs::exists(path("result.toml")));
  const ProgramRun resumed = commission(lines + "go\ngo\ngo\nfinish\n", "solar015", " --resume");
  EXPECT_EQ(resumed.exit_code, 0) << resumed.out << resumed.err;
  EXPECT_TRUE(fs::exists(path("result.toml")));
  EXPECT_FALSE(fs::exists(path("result.toml.progress")));
  EXPECT_EQ(commission(lines, "solar015", " --resume").exit_code, 2) << "nothing is left to go on with";
}

TEST_F(HardwareCli, CommissioningByAScriptWritesAMachineFileThatTheOthersTake) {
  std::string lines = "ready\nconfigure\npressed\nreleased\n0\npilot\nguards\nmove\n";
  for (int j = 0; j < 3; ++j) lines += "go\nlonger\ngo\nshorter\n";
  for (int j = 0; j < 3; ++j) lines += "go\ngo\ngo\ntape\npreset\n";
  std::ofstream(path("result.toml")) << "mine\n";
  const ProgramRun run = commission(lines + "go\ngo\ngo\nfinish\n");
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_EQ(std::filesystem::file_size(path("result.1.toml")), 5U) << "the older file is kept";
  const ProgramRun doctor = run_program(knuckle::test::program("knuckle"),
                                        {"doctor", "--simulate", "--machine", path("result.toml"), "--listen", "0.2"});
  EXPECT_EQ(doctor.exit_code, 0) << doctor.out << doctor.err;
}

}  // namespace
}  // namespace knuckle::test
