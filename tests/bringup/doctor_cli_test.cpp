// `knuckle doctor` and `knuckle commission` from outside: exit codes, files, and one clear line for wrong usage.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>

#include "app/bringup/commission_command.h"
#include "app/bringup/doctor_command.h"
#include "tests/bringup/commission_script.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/run_program.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {
namespace {
namespace fs = std::filesystem;
using bringup::test::all;
using bringup::test::Script;

class HardwareCli : public testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const { return folder_.file(name); }
  /// With these words on standard input, a line each.
  ProgramRun commission(const Script& words, const std::string& machine = "solar015",
                        const std::string& more = "") const {
    std::ofstream answers(path("answers.txt"));
    for (const std::string& word : words) answers << word << '\n';
    answers.close();
    return run_program("/bin/sh", {"-c", knuckle::test::program("knuckle") + " commission --simulate --machine " +
                                             machine + " --out " + path("result.toml") + more + " --record " +
                                             path("recorded") + " < " + path("answers.txt")});
  }
  TemporaryFolder folder_;
};

TEST_F(HardwareCli, DoctorOfTheSimulatedBusIsWellAndSaysSoToTools) {
  const ProgramRun run =
      run_program(knuckle::test::program("knuckle"),
                  {"doctor", "--simulate", "--machine", "solar015", "--listen", "0.2", "--json", path("d.json")});
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_TRUE(says(run.out, "nothing wrong"));
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
  const auto doctored = doctor(drawing);
  ASSERT_EQ(doctored.size(), 10U);
  EXPECT_EQ(doctored, doctor(file));
  const auto identity = [this](const std::string& machine) { return readings(commission({"ready"}, machine).out); };
  const auto commissioned = identity(drawing);
  ASSERT_EQ(commissioned.size(), 10U);
  EXPECT_EQ(commissioned, identity(file));
}

TEST_F(HardwareCli, WrongUsageIsRefusedInOneLine) {
  std::ofstream(path("d.json")) << "mine\n";
  fs::create_directory(path("old"));
  std::ofstream(path("old/fast.csv")) << "mine\n";
  const std::string recorded = "commission --simulate --machine solar015 --out " + path("r.toml") + " --record ";
  const std::string simulated = "doctor --simulate --machine solar015 ";
  const std::vector<std::pair<std::string, std::string>> cases{
      {"doctor --can nosuch0", "nosuch0"},
      {"doctor --machine solar015", "needs --can"},
      {"doctor --simulate --bit-rate 250", "only goes without --machine"},
      {"doctor --device-file knuckle1", "needs --device"},
      {"doctor --listen 1", "needs --can"},
      {"doctor --connect 127.0.0.1", "--connect 127.0.0.1: "},
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
      {recorded + path("d.json"), "--record " + path("d.json")},
      {recorded + "-", "--record -"},
      {recorded + path("old"), "already contains fast.csv"},
  };
  for (const auto& [line, part] : cases) {
    std::istringstream in(line);
    const std::vector<std::string> arguments{std::istream_iterator<std::string>(in), {}};
    const std::string said = refusal([&, &given = arguments] {
      (void)cli::parse_command_line({"knuckle", "", "", {bringup::doctor_entry(), bringup::commission_entry()}}, given)
          .run();
    });
    EXPECT_TRUE(says(said, part)) << line;
    EXPECT_FALSE(says(said, "\n"));
  }
  EXPECT_FALSE(fs::exists(path("r.toml")));
  EXPECT_EQ(fs::file_size(path("d.json")), 5U);
}

TEST_F(HardwareCli, CommissioningThatEndsEarlyWritesNothing) {
  const ProgramRun run = commission({"ready", "configure", "no"});
  EXPECT_EQ(run.exit_code, 1) << run.err;
  EXPECT_TRUE(says(run.err, "machine neutral, nothing written"));
  EXPECT_FALSE(fs::exists(path("result.toml")));
  EXPECT_EQ(folder_.count(), 1) << "the answers alone: the folder of recordings is made for them";
}

TEST_F(HardwareCli, ADeadGuardCanBePractisedOnTheSimulatedMachine) {
  const ProgramRun run = commission(all(), "solar015", " --fault guard_dead:arm_valve@0");
  EXPECT_EQ(run.exit_code, 1) << run.err;
  EXPECT_TRUE(says(run.err, "arm_valve: guard not proved: "));
}

TEST_F(HardwareCli, AnOutputThatNobodyCanReadEndsItBeforeAnythingIsConfigured) {
  const ProgramRun run = commission(all(), "solar015", " > /dev/full");
  EXPECT_EQ(run.exit_code, 2) << run.err;
  EXPECT_TRUE(says(run.err, "standard output: cannot be written"));
  EXPECT_FALSE(fs::exists(path("result.toml")));
}

TEST_F(HardwareCli, CommissioningThatHasEndedGoesOnWithResumeAndWritesAMachineFileThatTheOthersTake) {
  Script ended_in_step_6 = bringup::test::first_words(bringup::test::kStroked);
  ended_in_step_6.emplace_back("no");
  std::ofstream(path("result.toml")) << "mine\n";
  const ProgramRun ended = commission(ended_in_step_6, "solar015", " --log " + path("log"));
  EXPECT_EQ(ended.exit_code, 1) << ended.err;
  EXPECT_TRUE(says(ended.err, "with --resume goes on"));
  EXPECT_TRUE(says(ended.out, "recorded in " + path("log")));
  EXPECT_TRUE(fs::exists(path("result.toml.progress")));
  EXPECT_EQ(fs::file_size(path("result.toml")), 5U) << "not written yet";
  Script rest = bringup::test::first_words(bringup::test::kSigned);
  rest.insert(rest.end(), {"go", "go", "go", "finish"});
  const ProgramRun resumed = commission(rest, "solar015", " --resume");
  EXPECT_EQ(resumed.exit_code, 0) << resumed.out << resumed.err;
  EXPECT_EQ(fs::file_size(path("result.1.toml")), 5U) << "the older file is kept";
  EXPECT_FALSE(fs::exists(path("result.toml.progress")));
  const ProgramRun doctor = run_program(knuckle::test::program("knuckle"),
                                        {"doctor", "--simulate", "--machine", path("result.toml"), "--listen", "0.2"});
  EXPECT_EQ(doctor.exit_code, 0) << doctor.out << doctor.err;
  EXPECT_EQ(commission(rest, "solar015", " --resume").exit_code, 2) << "nothing is left to go on with";
}

}  // namespace
}  // namespace knuckle::test
