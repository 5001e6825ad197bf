// The machine's side with its simulated machine, as a program of its own, and an operator's end of the link in the
// test's hand.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/programs/program_rig.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"
#include "transport/machine_status.h"

namespace knuckle::test {
namespace {

int lines_with(const std::string& text, const std::string& what) {
  std::istringstream in(text);
  int count = 0;
  for (std::string line; std::getline(in, line);) count += line.find(what) != std::string::npos ? 1 : 0;
  return count;
}

TEST(SimulatedSlaveThreads, RunsWithoutAnyInterfaceRecordsItsBusAndSaysThatItIsSimulated) {
  const TemporaryFolder folder;
  const std::string address = free_address();
  RunningProgram program(test::program("knuckle"),
                         {"slave", "--simulate", "--listen", address, "--insecure", "--candump", folder.file("bus.log"),
                          "--json", folder.file("run.json")});
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
  EXPECT_TRUE(test::says(run.err, "stopped: valves disabled, pilot pressure off"));
  const std::string bus = content(folder.file("bus.log"));
  EXPECT_GT(lines_with(bus, " 080#"), 20) << "SYNC";
  EXPECT_GT(lines_with(bus, " 190#"), 5) << "process data of the boom's valve";
  EXPECT_GT(lines_with(bus, " 210#"), 5) << "its set-points";
  const auto json = nlohmann::json::parse(content(folder.file("run.json")));
  EXPECT_TRUE(json.at("can").is_null());
  EXPECT_EQ(json.at("simulated").at("scenario"), "free_motion");
  EXPECT_EQ(json.at("simulated").at("seed"), 1);
  EXPECT_FALSE(json.contains("can_counters"));
  EXPECT_TRUE(json.at("realtime").contains("machine"));
  EXPECT_EQ(json.at("records_lost"), 0);
}

}  // namespace
}  // namespace knuckle::test
