// A stop gets through whoever does not read what a program says: the programs themselves, with pipes nobody reads.
#include <gtest/gtest.h>

#include <charconv>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/programs/program_rig.h"
#include "tests/support/bus_nodes.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/says.h"
#include "tests/support/stalled_pipe.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {
namespace {

using Arguments = std::vector<std::string>;

/// Only where something hangs.
constexpr std::chrono::seconds kHangs{60};

Arguments with(Arguments arguments, const Arguments& more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

class ProgramStopThreads : public testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const { return folder_.file(name); }
  [[nodiscard]] std::string contents(const std::string& name) const { return content(path(name)); }
  [[nodiscard]] nlohmann::json result() const { return nlohmann::json::parse(contents("run.json")); }
  [[nodiscard]] Arguments slave() const {
    return {"slave", "--simulate", "--listen", address_, "--insecure", "--json", path("run.json")};
  }

  /// Leads the machine, lets the reader fall asleep, leads it again, and asks the program to end.
  void stop_while_led(const RunningProgram& program, std::initializer_list<const StalledPipe*> pipes) {
    Hand hand(address_);
    ASSERT_TRUE(engage(hand));
    for (const StalledPipe* pipe : pipes) pipe->fill();
    hand.say([](MasterMessage& m) { m.enable = false; });  // what is told of it goes into the pipe
    ASSERT_TRUE(eventually([&] { return hand.sees(Mode::kReady); }));
    ASSERT_TRUE(engage(hand));
    const JointVector was = hand.machine()->position_rad;
    hand.lead(kArm, 0.3);
    ASSERT_TRUE(eventually([&] { return hand.machine()->position_rad[kArm] > was[kArm] + 0.02; })) << "it is led";
    program.signal(SIGTERM);
    EXPECT_TRUE(eventually([&] { return hand.sees(Mode::kOff); })) << "the machine is told off, with a hand that leads";
    EXPECT_TRUE(program.ends_within(kHangs));
  }
  /// The newest command to each valve in a log of the bus is neutral, and some before was not.
  void expect_neutral_at_the_end(const std::string& log) const {
    const BusDescription bus = machine().bus;
    std::map<unsigned, bool> moves;
    bool moved = false;
    std::istringstream in(log);
    for (std::string line; std::getline(in, line);) {
      const auto mark = line.find('#');
      ASSERT_TRUE(mark != std::string::npos && mark >= 3) << line;
      const auto hex = [&line](std::size_t at, std::size_t digits) {
        unsigned value = 0;
        std::from_chars(line.data() + at, line.data() + at + digits, value, 16);
        return value;
      };
      const unsigned id = hex(mark - 3, 3);
      const auto valves = test::nodes_with(bus, NodeRole::kValve);
      const bool command = std::any_of(valves.begin(), valves.end(),
                                       [id](const NodeDescription& valve) { return valve.rpdo_id() == id; });
      if (!command) continue;
      moves[id] = (hex(mark + 1, 2) & 7) == canopen::kControlActive && hex(mark + 5, 4) != 0;
      moved |= moves[id];
    }
    EXPECT_TRUE(moved);
    EXPECT_EQ(moves.size(), std::size_t{kJoints});
    for (const auto& [id, still] : moves) EXPECT_FALSE(still) << std::hex << id;
  }

  std::string address_ = free_address();

 private:
  TemporaryFolder folder_;
};

TEST_F(ProgramStopThreads, MakesTheMachineNeutralWhileNobodyReadsItsTableOrWhatItSays) {
  const StalledPipe table, said;
  RunningProgram program(test::program("knuckle"), with(slave(), {"--csv", "-", "--candump", path("bus.log")}),
                         table.writing_end(), said.writing_end());
  stop_while_led(program, {&table, &said});
  EXPECT_EQ(program.wait().exit_code, 0);
  expect_neutral_at_the_end(contents("bus.log"));
  EXPECT_EQ(result().at("stop").at("confirmed"), true);
  EXPECT_GT(result().at("records_lost"), 0) << "of the table: the log is whole";
}

TEST_F(ProgramStopThreads, EndsAlsoWhereNobodyReadsItsResult) {
  const StalledPipe pipe;
  pipe.fill();
  RunningProgram program(test::program("knuckle"),
                         {"slave", "--simulate", "--listen", address_, "--insecure", "--json", "-"},
                         pipe.writing_end());
  {
    Hand hand(address_);
    ASSERT_TRUE(eventually([&] { return hand.sees(Mode::kReady); }));
    program.signal(SIGTERM);
    EXPECT_TRUE(eventually([&] { return hand.sees(Mode::kOff); }));
  }
  ASSERT_TRUE(program.ends_within(kHangs));
  const ProgramRun run = program.wait();
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_TRUE(test::says(run.err, "--json -: cannot be written: no reader took it in time"));
}

TEST_F(ProgramStopThreads, TheOperatorsSideEndsWhileNobodyReadsWhatItSaysAndWrites) {
  const StalledPipe said, table;
  said.fill();
  table.fill();
  const RunningProgram machine(test::program("knuckle"), slave());
  RunningProgram program(test::program("knuckle"),
                         {"master", "--machine", "solar015", "--device", "none", "--connect", address_, "--insecure",
                          "--csv", "-", "--json", path("master.json")},
                         table.writing_end(), said.writing_end());
  ASSERT_TRUE(program.comes_to_note(SIGTERM));
  std::this_thread::sleep_for(1s);
  program.signal(SIGTERM);
  ASSERT_TRUE(program.ends_within(kHangs));
  EXPECT_EQ(program.wait().exit_code, 0);
  const auto json = nlohmann::json::parse(contents("master.json"));
  EXPECT_GT(json.at("records_lost"), 0);
}

TEST_F(ProgramStopThreads, AFullDiskIsToldDuringTheRunAndWhatWasWrittenStaysReadable) {
  Heard unused;
  StalledPipe said;
  RunningProgram program("/bin/sh",
                         {"-c", "ulimit -f 256; exec " + test::program("knuckle") + " slave --simulate --listen " +
                                    address_ + " --insecure --csv " + path("run.csv") + " --json " + path("run.json")},
                         -1, said.writing_end());
  std::string text;
  EXPECT_TRUE(eventually([&] {
    text += said.read_all();
    return text.find("run.csv: cannot be written: File too large: what was written before is kept") !=
           std::string::npos;
  })) << text;
  {
    Hand hand(address_);
    EXPECT_TRUE(engage(hand)) << "the machine is led on";
    program.signal(SIGTERM);
    EXPECT_TRUE(eventually([&] { return hand.sees(Mode::kOff); }));
  }
  ASSERT_TRUE(program.ends_within(kHangs));
  EXPECT_EQ(program.wait().exit_code, 2) << said.read_all();
  EXPECT_GT(result().at("records_lost"), 0);
  std::istringstream table(contents("run.csv"));
  std::string header, row;
  ASSERT_TRUE(std::getline(table, header));
  const auto columns = std::count(header.begin(), header.end(), ',');
  int rows = 0;
  for (; std::getline(table, row); ++rows) ASSERT_EQ(std::count(row.begin(), row.end(), ','), columns) << row;
  EXPECT_GT(rows, 100);
  EXPECT_EQ(contents("run.csv").back(), '\n');
}

TEST_F(ProgramStopThreads, AClosedStandardErrorDoesNotBecomeAnOutput) {
  const ProgramRun run =
      run_program("/bin/sh", {"-c", "exec " + test::program("knuckle") + " slave --simulate --listen " + address_ +
                                        " --insecure --duration 0.5 --csv " + path("run.csv") + " --json " +
                                        path("run.json") + " 0<&- 1>&- 2>&-"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_EQ(contents("run.csv").rfind("time_s,", 0), 0U);
  EXPECT_FALSE(test::says(contents("run.csv"), "knuckle"));
  EXPECT_GT(result().at("lines_lost"), 0);
}

TEST_F(ProgramStopThreads, AnOperatorsSideWhoseDeviceNeverCameHasFailed) {
  const ProgramRun run = run_program(
      test::program("knuckle"), {"master", "--machine", "solar015", "--device", "hid", "--serial", "no such device",
                                 "--connect", address_, "--insecure", "--duration", "0.5", "--json", path("run.json")});
  EXPECT_EQ(run.exit_code, 1) << run.err;
  EXPECT_TRUE(test::says(run.err, "--device hid: no haptic device was ready at any time: "));
  EXPECT_EQ(result().at("schema"), "knuckle-master/2") << "what happened is written all the same";
}

}  // namespace
}  // namespace knuckle::test
