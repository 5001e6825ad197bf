// A CAN interface that is not up yet: waited for where that was asked for, refused else.
#include "app/programs/can_opening.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::programs {
namespace {

/// What is waited for comes after so long; somebody may end the waiting before.
struct Wait {
  Duration comes_after{}, ended_after = 1h, now{};
  std::vector<std::string> said{};
  bool run() {
    return wait_until_there({[this] { return now >= comes_after ? "" : "is down"; },
                             [this](const std::string& why, bool first) {
                               said.push_back(std::to_string(to_seconds(now)).substr(0, 4) + (first ? " first " : " ") +
                                              why);
                             },
                             [this] { return now < ended_after; }, [this](Duration time) { now += time; }});
  }
};

TEST(CanOpening, SaysNothingWhereTheInterfaceIsThere) {
  Wait wait;
  EXPECT_TRUE(wait.run());
  EXPECT_TRUE(wait.said.empty());
}

TEST(CanOpening, SaysAtOnceWhatIsMissingAndEveryTenSecondsAgain) {
  Wait wait{.comes_after = 25s};
  EXPECT_TRUE(wait.run());
  EXPECT_EQ(wait.said, (std::vector<std::string>{"0.00 first is down", "10.0 is down", "20.0 is down"}));
  EXPECT_EQ(wait.now, 25s) << "and looks in between";
}

TEST(CanOpening, WaitsNoLongerThanSomebodyWantsItTo) {
  Wait wait{.comes_after = 1h, .ended_after = 3s};
  EXPECT_FALSE(wait.run());
  EXPECT_EQ(wait.now, 3s);
}

std::vector<std::string> slave(const std::string& interface, bool waits) {
  std::vector<std::string> words{"slave",       "--machine",  "solar015", "--can",      interface, "--listen",
                                 "127.0.0.1:0", "--insecure", "--no-log", "--duration", "1"};
  if (waits) words.emplace_back("--wait-for-can");
  return words;
}

TEST(CanOpening, TheMachinesSideWaitsUntilItIsAskedToEndSaysForWhatAndLeavesAResultOfNoTime) {
  const test::TemporaryFolder folder;
  std::vector<std::string> words = slave("nosuch7", true);
  words.insert(words.end(), {"--json", folder.file("result.json")});
  test::RunningProgram program(test::program("knuckle"), words);
  ASSERT_TRUE(program.interrupt_when_it_listens());
  const test::ProgramRun run = program.wait();
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(run.err.empty() || run.err.find("waiting for CAN interface nosuch7: no such interface") == 15U)
      << run.err;
  const std::string result = test::content(folder.file("result.json"));
  EXPECT_NE(result.find("\"ran_s\": 0.0"), std::string::npos) << result;
}

TEST(CanOpening, OutputsThatCannotBeWrittenAreRefusedBeforeItWaits) {
  std::vector<std::string> words = slave("nosuch7", true);
  words.insert(words.end(), {"--csv", "/dev/null/x.csv"});
  test::RunningProgram program(test::program("knuckle"), words);
  EXPECT_TRUE(program.ends_within(std::chrono::seconds(20)));
  program.signal(SIGINT);
  const test::ProgramRun run = program.wait();
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("--csv"), std::string::npos) << run.err;
}

TEST(CanOpening, IsRefusedAtOnceWhereNobodyAskedToWaitOrNoCanInterfaceWillEverBeThere) {
  for (const auto& [interface, waits, says] : {std::tuple{"nosuch7", false, "\"nosuch7\": no such interface"},
                                               {"lo", true, "\"lo\": is not a CAN interface"}}) {
    const test::ProgramRun run = test::run_program(test::program("knuckle"), slave(interface, waits));
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_NE(run.err.find(says), std::string::npos) << run.err;
  }
}

}  // namespace
}  // namespace knuckle::programs
