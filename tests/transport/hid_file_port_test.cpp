// The firmware's end of a cable as a file, over a packet socket pair.
#include "transport/hid_file_port.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <system_error>

#include "tests/support/refusal.h"
#include "tests/support/temporary_folder.h"

namespace knuckle {
namespace {

struct Pair {
  Pair() {
    int ends[2] = {-1, -1};
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends), 0);
    host = ends[0];
    port.emplace(ends[1]);
  }
  ~Pair() { hang_up(); }
  void hang_up() {
    if (host >= 0) ::close(host);
    host = -1;
  }
  int host = -1;
  std::optional<HidFilePort> port;
};

HidReport counting() {
  HidReport report;
  for (std::size_t i = 0; i < report.size(); ++i) report[i] = std::uint8_t(i + 1);
  return report;
}

TEST(HidFilePort, PassesReportsBothWaysAndNeverWaits) {
  Pair pair;
  HidReport report;
  EXPECT_FALSE(pair.port->read(report));
  EXPECT_TRUE(pair.port->connected());
  EXPECT_TRUE(pair.port->write(counting()));
  std::array<std::uint8_t, 100> heard{};
  ASSERT_EQ(::read(pair.host, heard.data(), heard.size()), 64);
  EXPECT_TRUE(std::equal(heard.begin(), heard.begin() + 64, counting().begin()));
  ASSERT_EQ(::write(pair.host, counting().data(), 64), 64);
  ASSERT_TRUE(pair.port->read(report));
  EXPECT_EQ(report, counting());
  ASSERT_EQ(::write(pair.host, counting().data(), 10), 10);
  ASSERT_TRUE(pair.port->read(report));
  HidReport truncated{};
  std::copy_n(counting().begin(), 10, truncated.begin());
  EXPECT_EQ(report, truncated) << "zeros behind it";
}

TEST(HidFilePort, RefusesReportsThatTheHostDoesNotFetchAndGoesOnWhenItDoes) {
  Pair pair;
  int taken = 0;
  while (pair.port->write(counting())) ++taken;
  EXPECT_GT(taken, 0);
  EXPECT_TRUE(pair.port->connected());
  HidReport heard;
  ASSERT_EQ(::read(pair.host, heard.data(), heard.size()), 64);
  EXPECT_TRUE(pair.port->write(counting()));
}

TEST(HidFilePort, SaysThatTheHostHasGone) {
  Pair pair;
  pair.hang_up();
  HidReport report;
  EXPECT_FALSE(pair.port->read(report));
  EXPECT_FALSE(pair.port->connected());
}

/// How often this program has the file open.
int times_open(const std::string& path) {
  int times = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code gone;
    times += std::filesystem::read_symlink(entry.path(), gone) == path ? 1 : 0;
  }
  return times;
}

TEST(HidFilePort, LetsGoOfTheFileWhenTheHostHasGoneAndOpensItAgainLater) {
  const std::string path = testing::TempDir() + "/hid_file_port_gadget";
  std::filesystem::remove(path);
  std::filesystem::create_symlink("/dev/full", path);  // takes no report
  HidFilePort port("--gadget", path);
  EXPECT_EQ(times_open("/dev/full"), 1);
  EXPECT_FALSE(port.write(counting()));
  EXPECT_EQ(times_open("/dev/full"), 0);  // may be bound anew from here on
  std::filesystem::remove(path);
  std::filesystem::create_symlink("/dev/null", path);  // takes every report
  const int others = times_open("/dev/null");
  bool taken = false;
  for (int i = 0; i < 1000 && !taken; ++i) taken = port.write(counting());
  EXPECT_TRUE(taken);
  EXPECT_TRUE(port.connected());
  EXPECT_EQ(times_open("/dev/null"), others + 1);
  std::filesystem::remove(path);
}

TEST(HidFilePort, WritesOverNoFileAndNamesTheOneThatCannotBeOpened) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("mine.txt");
  std::ofstream(path) << "kept";
  EXPECT_NE(test::refusal([&] { HidFilePort("--gadget", path); }), "accepted");
  EXPECT_EQ(test::content(path), "kept");
  EXPECT_EQ(test::refusal([&] { HidFilePort("--gadget", "/nowhere/hidg0"); }),
            "--gadget /nowhere/hidg0: cannot be opened: No such file or directory");
}

}  // namespace
}  // namespace knuckle
