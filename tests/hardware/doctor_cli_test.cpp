// `knuckle doctor` and `knuckle commission` from outside: exit codes, files, and one clear line for wrong usage.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/run_program.h"

namespace knuckle::test {
namespace {
namespace fs = std::filesystem;

class HardwareCli : public testing::Test {
 protected:
  HardwareCli() {
    std::string name = (fs::temp_directory_path() / "knuckle_doctor_XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~HardwareCli() override { fs::remove_all(folder_); }
  [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }
  /// With these lines on standard input.
  ProgramRun commission(const std::string& lines) const {
    std::ofstream(path("answers.txt")) << lines;
    return run_program("/bin/sh",
                       {"-c", std::string(KNUCKLE_BINARY) + " commission --simulate --machine solar015 --out " +
                                  path("result.toml") + " --record " + folder_.string() + " < " + path("answers.txt")});
  }
  fs::path folder_;
};

TEST_F(HardwareCli, DoctorOfTheSimulatedBusIsWellAndSaysSoToTools) {
  const ProgramRun run = run_program(
      KNUCKLE_BINARY, {"doctor", "--simulate", "--machine", "solar015", "--listen", "0.2", "--json", path("d.json")});
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_NE(run.out.find("nothing wrong"), std::string::npos);
  std::ifstream file(path("d.json"));
  const auto json = nlohmann::json::parse(file);
  EXPECT_EQ(json["schema"], "knuckle.doctor");
  EXPECT_EQ(json["passed"], true);
  EXPECT_EQ(json["nodes"].size(), 14U);
}

TEST_F(HardwareCli, WrongUsageIsOneLineAndTwo) {
  const auto line = [](std::vector<std::string> arguments) {
    const ProgramRun run = run_program(KNUCKLE_BINARY, std::move(arguments));
    EXPECT_EQ(run.exit_code, 2) << run.out;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    return run.err;
  };
  EXPECT_NE(line({"doctor", "--can", "nosuch0"}).find("nosuch0"), std::string::npos);
  EXPECT_NE(line({"doctor", "--machine", "solar015"}).find("needs --can"), std::string::npos);
  EXPECT_NE(line({"doctor", "--simulate"}).find("needs --machine"), std::string::npos);
  EXPECT_NE(line({"doctor", "--device-file", "knuckle1"}).find("needs --device"), std::string::npos);
  EXPECT_NE(line({"doctor", "--listen", "1"}).find("needs --can"), std::string::npos);
  EXPECT_NE(line({"doctor", "--device", "hid", "--bit-rate", "250"}).find("needs --can"), std::string::npos);
  EXPECT_NE(line({"commission", "--machine", "solar015", "--out", path("r.toml")}).find("needs --can"),
            std::string::npos);
  EXPECT_NE(line({"commission", "--simulate", "--machine", "solar015"}).find("--out"), std::string::npos);
  EXPECT_FALSE(fs::exists(path("r.toml")));
}

TEST_F(HardwareCli, CommissioningThatEndsEarlyWritesNothing) {
  const ProgramRun run = commission("ready\nconfigure\nno\n");
  EXPECT_EQ(run.exit_code, 1) << run.err;
  EXPECT_NE(run.err.find("machine neutral, nothing written"), std::string::npos) << run.err;
  EXPECT_FALSE(fs::exists(path("result.toml")));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);  // the answers alone
}

TEST_F(HardwareCli, CommissioningWritesOverNoRecording) {
  std::ofstream(path("fast.csv")) << "mine\n";
  const ProgramRun run = commission("ready\n");
  EXPECT_EQ(run.exit_code, 2) << run.out << run.err;
  EXPECT_NE(run.err.find("has fast.csv already"), std::string::npos) << run.err;
  EXPECT_EQ(std::filesystem::file_size(path("fast.csv")), 5U);
}

TEST_F(HardwareCli, CommissioningByAScriptWritesAMachineFileThatTheOthersTake) {
  std::string lines = "ready\nconfigure\npressed\nreleased\n0\npilot\nmove\n";
  for (int j = 0; j < 3; ++j) lines += "go\nlonger\ngo\nshorter\n";
  for (int j = 0; j < 3; ++j) lines += "go\ngo\ngo\ntape\npreset\n";
  std::ofstream(path("result.toml")) << "mine\n";
  const ProgramRun run = commission(lines + "go\ngo\ngo\nfinish\n");
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_EQ(std::filesystem::file_size(path("result.1.toml")), 5U) << "the older file is kept";
  const ProgramRun doctor =
      run_program(KNUCKLE_BINARY, {"doctor", "--simulate", "--machine", path("result.toml"), "--listen", "0.2"});
  EXPECT_EQ(doctor.exit_code, 0) << doctor.out << doctor.err;
}

}  // namespace
}  // namespace knuckle::test
