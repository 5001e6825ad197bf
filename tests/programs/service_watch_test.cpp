// What a service tells systemd, heard on a socket as systemd's; and a CAN interface that is not up yet: waited for
// where that was asked for, refused else.
#include "app/programs/service_watch.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::programs {
namespace {

using Lines = std::vector<std::string>;

/// The end of the socket that systemd holds.
class Systemd {
 public:
  explicit Systemd(const std::string& socket) : descriptor_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, socket.c_str(), sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  ~Systemd() { ::close(descriptor_); }
  Systemd(const Systemd&) = delete;
  Systemd& operator=(const Systemd&) = delete;

  /// Since the last call.
  [[nodiscard]] Lines heard() const {
    Lines lines;
    std::array<char, 4096> bytes{};
    for (;;) {
      const auto size = ::recv(descriptor_, bytes.data(), bytes.size(), 0);
      if (size < 0) return lines;
      lines.emplace_back(bytes.data(), static_cast<std::size_t>(size));
    }
  }

 private:
  int descriptor_;
};

class ServiceWatchTest : public testing::Test {
 protected:
  ServiceWatchTest() : socket_(folder_.file("notify")), systemd_(socket_) {
    setenv("NOTIFY_SOCKET", socket_.c_str(), 1);
    setenv("WATCHDOG_USEC", "400000", 1);
    unsetenv("WATCHDOG_PID");
  }
  ~ServiceWatchTest() override {
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
  }

  test::TemporaryFolder folder_;
  std::string socket_;
  Systemd systemd_;
};

TEST_F(ServiceWatchTest, IsReadyWithTheFirstStepOfTheLoopAndNotBefore) {
  ServiceWatch watch;
  watch.tell(Time(0ms), 0, "");
  EXPECT_EQ(systemd_.heard(), Lines{});
  watch.tell(Time(20ms), 1, "");
  EXPECT_EQ(systemd_.heard(), (Lines{"READY=1", "WATCHDOG=1"}));
}

TEST_F(ServiceWatchTest, AsksForTimeWhileTheLoopHasToWaitForItsBus) {
  ServiceWatch watch;
  watch.wait("waiting for CAN interface can0", 30s);
  EXPECT_EQ(systemd_.heard(), Lines{"EXTEND_TIMEOUT_USEC=30000000\nSTATUS=waiting for CAN interface can0"});
}

TEST_F(ServiceWatchTest, FeedsTheWatchdogOnlyWhileTheLoopSteps) {
  ServiceWatch watch;
  std::uint64_t steps = 0;
  Time now{};
  Lines heard;
  for (; now < Time(1s); now += 20ms) {
    watch.tell(now, ++steps, "engaged");
    for (std::string& line : systemd_.heard()) heard.push_back(std::move(line));
  }
  EXPECT_EQ(heard.size(), 12u) << "READY, STATUS, and WATCHDOG every quarter of 0.4 s";
  for (; now < Time(5s); now += 20ms) watch.tell(now, steps, "engaged");  // the loop hangs, this thread does not
  EXPECT_LE(systemd_.heard().size(), 1u) << "of steps just before";
  watch.tell(now, ++steps, "engaged");
  EXPECT_EQ(systemd_.heard(), Lines{"WATCHDOG=1"});
}

TEST_F(ServiceWatchTest, TellsHowThingsStandWhenThatChanges) {
  ServiceWatch watch;
  watch.tell(Time(0ms), 1, "ready");
  watch.tell(Time(20ms), 2, "ready");
  watch.tell(Time(40ms), 3, "engaged");
  EXPECT_EQ(systemd_.heard(), (Lines{"READY=1", "STATUS=ready", "WATCHDOG=1", "STATUS=engaged"}));
}

TEST_F(ServiceWatchTest, NeverWaitsForAManagerThatDoesNotRead) {
  ServiceWatch watch;
  for (std::uint64_t step = 1; step < 5000; ++step) watch.tell(Time(20ms * step), step, std::to_string(step));
  watch.stopping();
  EXPECT_FALSE(systemd_.heard().empty());
  watch.tell(Time(200s), 5000, "engaged");
  EXPECT_EQ(systemd_.heard(), (Lines{"STATUS=engaged", "WATCHDOG=1"}));
}

TEST_F(ServiceWatchTest, WithoutAWatchdogNothingIsFed) {
  unsetenv("WATCHDOG_USEC");
  ServiceWatch watch;
  for (std::uint64_t step = 1; step < 100; ++step) watch.tell(Time(20ms * step), step, "");
  watch.stopping();
  EXPECT_EQ(systemd_.heard(), (Lines{"READY=1", "STOPPING=1"}));
}

TEST_F(ServiceWatchTest, TheMachinesSideTellsItsStartItsModeItsStepsAndItsEnd) {
  // Fed every 0.5 s: nobody reads until the program has ended, and a socket keeps 10 lines (net.unix.max_dgram_qlen).
  setenv("WATCHDOG_USEC", "2000000", 1);
  const test::ProgramRun run = test::run_program(
      test::program("knuckle"),
      {"slave", "--simulate", "--listen", "127.0.0.1:0", "--insecure", "--no-log", "--duration", "2"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const Lines heard = systemd_.heard();
  ASSERT_GE(heard.size(), 4u);
  EXPECT_EQ(heard.front(), "READY=1");
  EXPECT_EQ(heard.back(), "STOPPING=1");
  EXPECT_GE(std::count(heard.begin(), heard.end(), "WATCHDOG=1"), 2);
  EXPECT_TRUE(std::any_of(heard.begin(), heard.end(),
                          [](const std::string& line) { return line.starts_with("STATUS=") && line.size() > 7; }));
}

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

TEST(CanOpening, SaysAtOnceWhatIsMissingAndEveryTenSecondsAgain) {
  Wait there, wait{.comes_after = 25s};
  EXPECT_TRUE(there.run());
  EXPECT_TRUE(there.said.empty());
  EXPECT_TRUE(wait.run());
  EXPECT_EQ(wait.said, (std::vector<std::string>{"0.00 first is down", "10.0 is down", "20.0 is down"}));
  EXPECT_EQ(wait.now, 25s) << "and looks in between";
}

TEST(CanOpening, WaitsNoLongerThanSomebodyWantsItTo) {
  Wait wait{.comes_after = 1h, .ended_after = 3s};
  EXPECT_FALSE(wait.run());
  EXPECT_EQ(wait.now, 3s);
}

TEST(CanOpening, TheMachinesSideWaitsUntilItIsAskedToEndSaysForWhatAndLeavesAResultOfNoTime) {
  const test::TemporaryFolder folder;
  test::RunningProgram program(test::program("knuckle"),
                               {"slave", "--machine", "solar015", "--can", "nosuch7", "--wait-for-can", "--listen",
                                "127.0.0.1:0", "--insecure", "--no-log", "--json", folder.file("result.json")});
  ASSERT_TRUE(program.interrupt_when_it_listens());
  const test::ProgramRun run = program.wait();
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(run.err.empty() || run.err.find("waiting for CAN interface nosuch7: no such interface") == 15U)
      << run.err;
  const std::string result = test::content(folder.file("result.json"));
  EXPECT_TRUE(test::says(result, "\"ran_s\": 0.0"));
}

}  // namespace
}  // namespace knuckle::programs
