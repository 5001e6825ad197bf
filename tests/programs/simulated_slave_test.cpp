// The machine's side with its simulated machine, as a program of its own, and an operator's end of the link in the
// test's hand.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/programs/program_rig.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "transport/machine_status.h"

namespace knuckle::test {
namespace {

namespace fs = std::filesystem;

class SimulatedSlaveThreads : public testing::Test {
 protected:
  SimulatedSlaveThreads() { fs::create_directories(folder_); }
  ~SimulatedSlaveThreads() override { fs::remove_all(folder_); }
  [[nodiscard]] std::string path(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] std::string contents(const std::string& name) const {
    std::ifstream in(path(name));
    return {std::istreambuf_iterator<char>(in), {}};
  }

 private:
  fs::path folder_ = fs::path(testing::TempDir()) / ("simulated_slave_" + std::to_string(getpid()));
};

/// A port that was free a moment ago.
std::string free_address() {
  const UdpLink probe = UdpLink::listen("127.0.0.1:0");
  return "127.0.0.1:" + std::to_string(probe.port());
}

int lines_with(const std::string& text, const std::string& what) {
  std::istringstream in(text);
  int count = 0;
  for (std::string line; std::getline(in, line);) count += line.find(what) != std::string::npos ? 1 : 0;
  return count;
}

TEST_F(SimulatedSlaveThreads, RunsWithoutAnyInterfaceRecordsItsBusAndSaysThatItIsSimulated) {
  const std::string address = free_address();
  RunningProgram program(test::program("knuckle"), {"slave", "--simulate", "--listen", address, "--insecure",
                                                    "--candump", path("bus.log"), "--json", path("run.json")});
  {
    Hand hand(address);
    ASSERT_TRUE(eventually([&] { return hand.sees(Mode::kReady); }));  // its nodes are set up, its valves active
    const std::uint32_t then = hand.machine()->stamp.sequence;
    ASSERT_TRUE(eventually([&] { return hand.machine()->stamp.sequence > then + 50; }));
  }
  program.signal(SIGTERM);
  const ProgramRun run = program.wait();
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(lines_with(run.err, "SIMULATED"), 1) << run.err;
  EXPECT_NE(run.err.find("stopped: valves disabled, pilot pressure off"), std::string::npos) << run.err;
  const std::string bus = contents("bus.log");
  EXPECT_GT(lines_with(bus, " 080#"), 20) << "SYNC";
  EXPECT_GT(lines_with(bus, " 190#"), 5) << "process data of the boom's valve";
  EXPECT_GT(lines_with(bus, " 210#"), 5) << "its set-points";
  const auto json = nlohmann::json::parse(contents("run.json"));
  EXPECT_TRUE(json.at("can").is_null());
  EXPECT_EQ(json.at("simulated").at("scenario"), "free_motion");
  EXPECT_EQ(json.at("simulated").at("seed"), 1);
  EXPECT_FALSE(json.contains("can_counters"));
  EXPECT_TRUE(json.at("realtime").contains("machine"));
  EXPECT_EQ(json.at("records_lost"), 0);
}

TEST_F(SimulatedSlaveThreads, AnOperatorOverTheLinkLeadsItsMachineAndHearsItsStatus) {
  const std::string address = free_address();
  RunningProgram program(test::program("knuckle"), {"slave", "--simulate", "--seed", "2", "--listen", address,
                                                    "--insecure", "--json", path("run.json")});
  {
    Hand hand(address);
    const auto follows = [&hand] {
      hand.lead(kArm, 0);
      if (!engage(hand)) return false;
      const double was_rad = hand.machine()->position_rad[kArm];
      hand.lead(kArm, 0.05);
      const auto moved = [&] { return hand.machine()->position_rad[kArm] > was_rad + 0.02; };
      return eventually([&] { return moved() || !hand.sees(Mode::kEngaged); }) && moved();
    };
    // A computer too busy to keep the link alive may need more than one try: the machine then stops, as it should.
    bool followed = false;
    for (int tries = 8; tries > 0 && !followed; --tries) followed = follows();
    EXPECT_TRUE(followed);
    if (followed) {
      EXPECT_TRUE(eventually([&] {
        const auto status = hand.status();
        return status && status->pilot_on && status->acted_report_at != kNever && status->bus_load > 0.05 &&
               status->steps > 0;
      }));
    }
  }
  program.signal(SIGTERM);
  const ProgramRun run = program.wait();
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const auto json = nlohmann::json::parse(contents("run.json"));
  EXPECT_EQ(json.at("malformed_datagrams"), 0);
}

TEST_F(SimulatedSlaveThreads, WritesIntoThePipeThatStandardOutputIs) {
  const ProgramRun run = run_program(
      "/bin/sh", {"-c", test::program("knuckle") +
                            " slave --simulate --listen 127.0.0.1:0 --insecure --duration 0.3 --json /dev/stdout "
                            "| cat"});
  EXPECT_EQ(nlohmann::json::parse(run.out, nullptr, false).value("schema", ""), "knuckle-slave/1") << run.err;
}

struct Refused {
  std::vector<std::string> arguments;
  std::string says;
};

TEST_F(SimulatedSlaveThreads, KeepsItsOtherFilesWhereTheDiskRefusesOne) {
  const ProgramRun run = run_program(
      test::program("knuckle"), {"slave", "--simulate", "--listen", "127.0.0.1:0", "--insecure", "--duration", "0.3",
                                 "--candump", "/dev/full", "--json", path("run.json")});
  EXPECT_EQ(run.exit_code, 2) << run.err;
  EXPECT_NE(run.err.find("/dev/full: cannot be written: No space left on device"), std::string::npos) << run.err;
  EXPECT_EQ(nlohmann::json::parse(contents("run.json")).at("schema"), "knuckle-slave/1");
}

TEST(SimulatedSlave, TakesExactlyOneBusAndNothingInVain) {
  const std::vector<Refused> cases{
      {{}, "needs --can, or --simulate"},
      {{"--simulate", "--can", "vcan0"}, "--can vcan0: give --can or --simulate, not both"},
      {{"--can", "vcan0"}, "--machine: is required with --can"},
      {{"--can", "vcan0", "--machine", "solar015", "--scenario", "dismantle"}, "--scenario dismantle: only goes with"},
      {{"--simulate", "--scenario", "link_faults"}, "link_faults.toml: schedules faults, which need virtual time"},
      {{"--can", "vcan0", "--machine", "solar015", "--seed", "3"}, "--seed 3: only goes with --simulate"},
      {{"--simulate", "--seed", "-1"}, "seed"},
      {{"--simulate", "--scenario", "no_such_scenario"}, "no_such_scenario"},
      {{"--simulate", "--machine", "no_such_machine"}, "no_such_machine"},
  };
  for (const Refused& refused : cases) {
    std::vector<std::string> arguments{"slave", "--listen", "127.0.0.1:0", "--insecure", "--duration", "1"};
    arguments.insert(arguments.end(), refused.arguments.begin(), refused.arguments.end());
    const ProgramRun run = run_program(test::program("knuckle"), arguments);
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_NE(run.err.find(refused.says), std::string::npos) << run.err;
    EXPECT_EQ(lines_with(run.err, ""), 1) << run.err;
  }
}

}  // namespace
}  // namespace knuckle::test
