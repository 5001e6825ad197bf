// `knuckle console` as a program: what it refuses, in one line, and what its Stop does.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "app/console/console_host.h"
#include "tests/console/window/canned_console.h"
#include "tests/console/window/console_run.h"
#include "tests/console/window/virtual_display.h"

namespace knuckle::console::window {
namespace {

TEST(ConsoleCommand, SaysInOneLineWhatIsMissing) {
  expect_refused("--simulate", "no display", "-u DISPLAY -u WAYLAND_DISPLAY");
  expect_refused("--simulate", "/nowhere/B612-Regular.otf is missing", "KNUCKLE_FONT_DIR=/nowhere");
  const VirtualDisplay display("1280x800");
  if (!display.up()) GTEST_SKIP() << "console: SKIPPED, no Xvfb here (package xvfb)";
  expect_refused("--simulate --device gamepad", "no gamepad found");
  const VirtualDisplay plain("1280x800", {"-extension", "GLX"});
  expect_refused("--simulate", "OpenGL 3.3 is missing");
}

TEST(ConsoleCommand, RefusesWhatContradictsItselfOrIsOutOfBounds) {
  const std::string lab = "--connect 127.0.0.1:5683 --insecure --machine solar015 ";
  const std::vector<RefusedOptions> refused{
      {"", "--simulate and --connect"},
      {"--simulate --connect 127.0.0.1:5683", "--simulate and --connect"},
      {"--connect 127.0.0.1:5683 --machine solar015 --keys /no/such/folder", "knuckle pair"},
      {"--connect 192.0.2.7:5683 --machine solar015 --insecure", "give --insecure twice"},
      {"--connect 127.0.0.1:5683 --insecure", "--machine"},
      {lab + "--demo", "--demo"},
      {lab + "--scenario dismantle", "--scenario: goes with --simulate"},
      {lab + "--keys /tmp", "--keys /tmp: does not go with --insecure"},
      {lab + "--camera mast=simulated", "a simulated camera goes with --simulate"},
      {lab + "--insecure --camera mast=knuckle:127.0.0.1:5700 --camera rear=knuckle:0.0.0.0:5700",
       "--camera rear=knuckle:0.0.0.0:5700: camera mast has this port"},
      {"--dial foo --peer arm --machine solar015", "--dial foo: is not HOST:PORT"},
      {"--simulate --insecure", "--insecure: goes with --connect"},
      {"--simulate --keys /tmp", "--keys /tmp: goes with --connect or --dial"},
      {"--simulate --peer arm", "--peer arm: goes with --dial"},
      {"--simulate --stun stun.example.org:3478", "goes with --dial"},
      {"--simulate --turn turn.example.org:3478", "goes with --dial"},
      {"--simulate --camera videotestsrc", "--camera videotestsrc: must be NAME=SOURCE"},
      {"--simulate --camera mast=nosuchsrc", "no element \"nosuchsrc\""},
      {"--simulate --camera a=videotestsrc --camera a=videotestsrc", "--camera a: is given twice"},
      {"--simulate --camera mast=knuckle:5700", "--camera mast=knuckle:"},
      {"--simulate --camera mast=knuckle:127.0.0.1:0", "its port must be 1 to 65535"},
      {"--simulate --camera mast=knuckle:0.0.0.0:5700", "pictures are not encrypted"},
      {"--simulate --camera rear=simulated", "solar015.toml has no [[camera]] of this name"},
      {"--simulate --demo --device hid", "--device hid: does not go with --demo"},
      {"--simulate --demo --scenario recorded_dig_soil", "follows a recorded motion: run it with"},
      {"--simulate --scenario link_faults", "schedules faults"},
      {"--simulate --scenario nowhere", "nowhere"},
      {"--simulate --log /tmp --no-log", "--no-log: does not go with --log /tmp"},
      {"--simulate --log /dev/null/log", "--log /dev/null/log: cannot be written: Not a directory"},
      {"--simulate --size 640x480", "1280x720"},
      {"--simulate --screenshot /tmp/s.jpg", "--screenshot /tmp/s.jpg: must end in .png"},
      {"--simulate --scale 9", "--scale"},
      {"--simulate --screen nowhere", "--screen"},
      {"--simulate --device mouse", "--device"},
      {"--simulate --loss 2", "--loss"}};
  for (const RefusedOptions& row : refused) expect_refused_options(row);
  EXPECT_TRUE(test::says(test::refusal([] { return camera_source({}, "mast=knuckle: 127.0.0.1:5700"); }),
                         "must be NAME=knuckle:ADDR:PORT without blanks"));
}

TEST(ConsoleCommand, AScreenshotWithoutATimeIsOfAMachineThatHasBeenHeard) {
  const VirtualDisplay display("1280x800");
  if (!display.up()) GTEST_SKIP() << "console: SKIPPED, no Xvfb here (package xvfb)";
  const std::string picture = testing::TempDir() + "knuckle_screenshot.png";
  const Ended ended = console_run("--simulate --json - --screenshot " + picture);
  std::filesystem::remove(picture);
  EXPECT_EQ(ended.code, 0) << ended.said;
  EXPECT_NE(ended.said.find("\"mode\": \"ready\""), std::string::npos) << ended.said;
}

/// Whoever reads the log is away for longer than the loop keeps frames.
TEST(DeepConsoleCommand, SaysHowManyFramesAreMissingInALogThatCouldNotBeWritten) {
  const VirtualDisplay display("1280x800");
  if (!display.up()) GTEST_SKIP() << "console: SKIPPED, no Xvfb here (package xvfb)";
  const std::string pipe = testing::TempDir() + "console_log_" + std::to_string(getpid());
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  std::thread reader([&pipe] {
    std::ifstream in(pipe);
    std::this_thread::sleep_for(std::chrono::seconds(40));
    for (std::string line; std::getline(in, line);) {
    }
  });
  const Ended ended = console_run("--simulate --duration 5 --candump " + pipe);
  reader.join();
  std::filesystem::remove(pipe);
  EXPECT_EQ(ended.code, 0) << ended.said;
  EXPECT_NE(ended.said.find(" records are missing"), std::string::npos) << ended.said;
}

/// A simulated session that its scenario leads, on virtual time, behind a real window.
class LedConsole : public testing::Test {
 protected:
  void SetUp() override {
    if (!display_.up()) GTEST_SKIP() << "console: SKIPPED, no Xvfb here (package xvfb)";
    session::SimulateOptions options;
    options.scenario = "wall_contact";
    host_ = std::make_unique<ConsoleHost>(options, LiveSession::Led::kByScenario, nullptr, nullptr);
    window_ = std::make_unique<ConsoleWindow>(WindowOptions{.full_speed = true}, canned_facts());
    for (; host_->view().machine.mode != Mode::kEngaged && at_s_ < 20;) run(0.1);
    run(0.5);
    ASSERT_EQ(host_->view().machine.mode, Mode::kEngaged);
  }
  void frames(int count) {
    for (int i = 0; i < count; ++i) {
      window_->frame(host_->view(), host_->health(), events_, 0);
      window_->show();
      host_->put(window_->input(host_->now()));
    }
  }
  void run(double seconds) { host_->skip_to(at_s_ += seconds); }

  VirtualDisplay display_{"1280x800"};
  std::unique_ptr<ConsoleHost> host_;
  std::unique_ptr<ConsoleWindow> window_;
  EventBook events_;
  double at_s_ = 0;
};

TEST_F(LedConsole, StopTakesTheMachineToNeutralAndStaysUntilReleased) {
  const auto released = [this] {
    window_->state().stop = false;
    frames(1);
  };
  for (const char* held : {"ctrl+", "shift+", "ctrl+shift+alt+"}) {
    released();
    ASSERT_TRUE(xdotool(std::string("key ") + held + "space"));
    frames(2);
    EXPECT_TRUE(window_->state().stop) << held;
  }
  for (const int x : {1060, 1150, 1250}) {
    released();
    for (int click = 0; click < 2; ++click) {
      ASSERT_TRUE(xdotool("mousemove " + std::to_string(x) + " 740 mousedown 1"));
      frames(3);
      ASSERT_TRUE(xdotool("mouseup 1"));
      frames(3);
      EXPECT_TRUE(window_->state().stop) << x << ": a second click where Stop is does not release it";
    }
  }
  for (int screen = 1; screen <= 6; ++screen) {
    released();
    ASSERT_TRUE(xdotool("key F" + std::to_string(screen) + " mousemove 1150 740 mousedown 1"));
    frames(3);
    EXPECT_TRUE(window_->state().stop) << "screen " << screen;
    ASSERT_TRUE(xdotool("mouseup 1 mousemove 500 5"));
    frames(3);
  }
  released();
  run(0.5);
  ASSERT_EQ(host_->view().machine.mode, Mode::kEngaged);
  ASSERT_TRUE(xdotool("key space"));
  frames(2);
  run(0.6);
  EXPECT_EQ(host_->view().machine.mode, Mode::kFault);
  EXPECT_EQ(host_->view().machine.fault.code, ReasonCode::kOperatorStop);
  EXPECT_EQ(host_->view().status.valve_command, JointVector(JointVector::Zero()));
  EXPECT_LT(host_->view().status.spool.cwiseAbs().maxCoeff(), 0.05);
  EXPECT_TRUE(window_->state().stop);
  ASSERT_TRUE(xdotool("key ctrl+BackSpace"));
  frames(2);
  EXPECT_FALSE(window_->state().stop);
}

TEST(ConsoleWindowSize, IsWithinTheDisplaySoThatStopIsOnIt) {
  const VirtualDisplay display("1024x768");
  if (!display.up()) GTEST_SKIP() << "console: SKIPPED, no Xvfb here (package xvfb)";
  for (const float scale : {0.75F, 1.F, 3.F}) {
    ConsoleWindow window({.scale = scale, .full_speed = true}, canned_facts());
    EventBook events;
    const ConsoleView view = canned_view();
    const LoopHealth loop;
    const auto frames = [&] {
      for (int i = 0; i < 3; ++i) {
        window.frame(view, loop, events, 0);
        window.show();
      }
    };
    frames();
    ASSERT_TRUE(xdotool("mousemove 960 710 mousedown 1"));
    frames();
    EXPECT_TRUE(window.state().stop) << scale;
    ASSERT_TRUE(xdotool("mouseup 1"));
  }
}

}  // namespace
}  // namespace knuckle::console::window
