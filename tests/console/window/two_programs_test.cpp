// The machine's side and the console as two programs: what a stopped, frozen or killed window means on the machine's
// CAN wire, read from the frames alone.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "tests/console/window/virtual_display.h"
#include "tests/support/free_address.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"

namespace knuckle::test {
namespace {

namespace fs = std::filesystem;

/// Reads a candump log while it is written into a pipe; knows of every valve whether it is asked to move.
class WireWatch {
 public:
  explicit WireWatch(const std::string& pipe) {
    mkfifo(pipe.c_str(), 0600);
    thread_ = std::thread([this, pipe] {
      std::ifstream in(pipe);
      for (std::string line; std::getline(in, line);) take(line);
    });
  }
  /// After the program that writes has ended.
  ~WireWatch() { thread_.join(); }
  [[nodiscard]] bool moving() const { return moving_ != 0; }
  /// Set-points that asked for motion so far.
  [[nodiscard]] std::uint64_t asked() const { return asked_; }
  /// Set-points of any kind so far.
  [[nodiscard]] std::uint64_t heard() const { return heard_; }

 private:
  static unsigned hex(const std::string& text, std::size_t at, std::size_t digits) {
    unsigned value = 0;
    std::from_chars(text.data() + at, text.data() + at + digits, value, 16);
    return value;
  }
  /// "(1.234567) can0 210#0700FF1F...": control word, then the set-point, little-endian.
  void take(const std::string& line) {
    const auto mark = line.find('#');
    if (mark == std::string::npos || mark < 3 || line.size() < mark + 9) return;
    const unsigned id = hex(line, mark - 3, 3), valve = id - 0x210;
    if (id < 0x210 || valve > 2) return;
    const bool active = (hex(line, mark + 1, 2) & 7) == 7;
    const bool moves = active && hex(line, mark + 5, 4) != 0;
    ++heard_;
    if (moves) ++asked_;
    moving_ = moves ? moving_ | 1U << valve : moving_ & ~(1U << valve);
  }
  std::atomic<unsigned> moving_{0};
  std::atomic<std::uint64_t> asked_{0}, heard_{0};
  std::thread thread_;
};

class TwoPrograms : public testing::Test {
 protected:
  void SetUp() override {
    if (!display_.up()) GTEST_SKIP() << "console: SKIPPED, no Xvfb here (package xvfb)";
  }
  void TearDown() override { end(); }
  /// Leads the machine, then does this to the console. @param fault what the machine's side says at its end, and no
  /// more: its own loop was not disturbed. Where this computer stood still instead, nothing was learned: once more.
  void while_led(const std::function<void()>& act, const std::string& fault) {
    for (int tries = 8; tries > 0; --tries) {
      begin();
      if (HasFatalFailure()) return;
      act();
      const std::vector<std::string> codes = faults();
      end();
      const bool stood_still = std::any_of(codes.begin(), codes.end(), [](const std::string& code) {
        return code == "sensor_stale" || code == "loop_overrun";
      });
      if (stood_still && tries > 1) continue;
      EXPECT_EQ(codes, std::vector<std::string>{fault});
      return;
    }
  }
  void begin() {
    fs::create_directories(folder_);
    wire_ = std::make_unique<WireWatch>(path("bus"));
    machine_ = std::make_unique<RunningProgram>(
        test::program("knuckle"), std::vector<std::string>{"slave", "--simulate", "--listen", address_, "--insecure",
                                                           "--candump", path("bus"), "--json", path("machine.json")});
    console_ = std::make_unique<RunningProgram>(
        test::program("knuckle"), std::vector<std::string>{"console", "--connect", address_, "--insecure", "--machine",
                                                           "solar015", "--log", path("log")});
    // A press counts once all else is there, so the keys are pressed again until the machine moves.
    for (int press = 0; press < 30 && !wire_->moving(); ++press) {
      (void)console::window::xdotool("keyup q keyup shift sleep 0.3 keydown shift sleep 1.2 keydown q");
      (void)eventually([&] { return wire_->moving(); }, 20);
    }
    ASSERT_TRUE(wire_->moving()) << "the keyboard moves the machine that is elsewhere";
  }
  void end() {
    if (console_) console_->signal(SIGKILL);
    if (console_) (void)console_->wait();
    console_.reset();
    if (machine_) machine_->signal(SIGTERM);
    if (machine_) (void)machine_->wait();
    machine_.reset();
    wire_.reset();
    fs::remove_all(folder_);
  }
  [[nodiscard]] std::string path(const std::string& name) const { return folder_ / name; }
  /// Tried every 50 ms.
  static bool eventually(const std::function<bool()>& so, int tries = 1200) {
    for (; tries > 0 && !so(); --tries) std::this_thread::sleep_for(std::chrono::milliseconds(50));
    return so();
  }
  /// All valves are told to stand still, and as many set-points later they still are.
  void expect_neutral_for_good() {
    ASSERT_TRUE(eventually([&] { return !wire_->moving(); }));
    const std::uint64_t asked = wire_->asked(), heard = wire_->heard();
    ASSERT_TRUE(eventually([&] { return wire_->heard() > heard + 300; })) << "the machine's loop goes on";
    EXPECT_EQ(wire_->asked(), asked) << "nothing moves again by itself";
  }
  /// What the machine's side says at its end. @return codes of its faults.
  std::vector<std::string> faults() {
    machine_->signal(SIGTERM);
    EXPECT_EQ(machine_->wait().exit_code, 0);
    machine_.reset();
    std::vector<std::string> codes;
    const auto json = nlohmann::json::parse(std::ifstream(path("machine.json")));
    for (const auto& fault : json.at("faults")) codes.push_back(fault.at("code"));
    return codes;
  }

  fs::path folder_ = fs::path(testing::TempDir()) / ("two_programs_" + std::to_string(getpid()));
  std::string address_ = free_address();
  console::window::VirtualDisplay display_{"1280x800"};
  std::unique_ptr<WireWatch> wire_;
  std::unique_ptr<RunningProgram> machine_, console_;
};

TEST_F(TwoPrograms, StopInTheWindowIsNeutralOnTheWire) {
  while_led(
      [this] {
        ASSERT_TRUE(console::window::xdotool("key space"));
        expect_neutral_for_good();
      },
      "operator_stop");
}

TEST_F(TwoPrograms, AFrozenConsoleIsNeutralAndStaysSoWhenItGoesOn) {
  while_led(
      [this] {
        console_->signal(SIGSTOP);
        expect_neutral_for_good();
        console_->signal(SIGCONT);  // the keys are still held
        expect_neutral_for_good();
      },
      "link_lost");
}

TEST_F(TwoPrograms, AKilledConsoleIsNeutral) {
  while_led(
      [this] {
        console_->signal(SIGKILL);
        expect_neutral_for_good();
      },
      "link_lost");
}

}  // namespace
}  // namespace knuckle::test
