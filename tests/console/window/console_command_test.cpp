// `knuckle console` as a program: what it refuses, in one line, and what its Stop does.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "app/console/console_host.h"
#include "tests/console/window/canned_console.h"
#include "tests/console/window/console_run.h"
#include "tests/console/window/virtual_display.h"
#include "tests/support/places.h"

namespace knuckle::console::window {
namespace {

TEST(ConsoleCommand, SaysInOneLineThatThereIsNoDisplay) {
  expect_refused("--simulate", "no display", "-u DISPLAY -u WAYLAND_DISPLAY");
  expect_refused("--simulate", "no display", "DISPLAY=:9999");
}

TEST(ConsoleCommand, SaysInOneLineThatAFontIsMissing) {
  expect_refused("--simulate", "/nowhere/B612-Regular.otf is missing", "KNUCKLE_FONT_DIR=/nowhere");
  expect_refused("--simulate", "B612-Regular.otf is missing", "KNUCKLE_FONT_DIR=" + test::source_dir());
}

TEST(ConsoleCommand, SaysInOneLineThatOpenGlIsMissing) {
  const VirtualDisplay display("1280x800", {"-extension", "GLX"});
  if (!display.up()) GTEST_SKIP() << "console: SKIPPED, no Xvfb here (package xvfb)";
  expect_refused("--simulate", "OpenGL 3.3 is missing");
}

TEST(ConsoleCommand, RefusesWhatContradictsItselfOrIsOutOfBounds) {
  expect_refused("", "--simulate and --connect");
  expect_refused("--simulate --connect 127.0.0.1:5683", "--simulate and --connect");
  expect_refused("--connect 127.0.0.1:5683 --machine solar015 --keys /no/such/folder", "knuckle pair");
  expect_refused("--connect 192.0.2.7:5683 --machine solar015 --insecure", "give --insecure twice");
  expect_refused("--connect 127.0.0.1:5683 --insecure", "--machine");
  expect_refused("--connect 127.0.0.1:5683 --insecure --machine solar015 --demo", "--demo");
  expect_refused("--connect 127.0.0.1:5683 --insecure --machine solar015 --scenario dismantle",
                 "--scenario: goes with --simulate");
  expect_refused("--connect 127.0.0.1:5683 --insecure --machine solar015 --seed 1", "--seed: goes with --simulate");
  expect_refused("--simulate --camera videotestsrc", "--camera videotestsrc: must be NAME=SOURCE");
  expect_refused("--simulate --camera mast=nosuchsrc", "no element \"nosuchsrc\"");
  expect_refused("--simulate --camera a=videotestsrc --camera a=videotestsrc", "--camera a: is given twice");
  expect_refused("--simulate --camera mast=knuckle:5700", "--camera mast=knuckle:");
  expect_refused("--simulate --camera 'mast=knuckle: 127.0.0.1:5700'",
                 "--camera mast=knuckle: 127.0.0.1:5700: must be NAME=knuckle:ADDR:PORT without blanks");
  expect_refused("--simulate --camera mast=knuckle:127.0.0.1:0", "its port must be 1 to 65535");
  expect_refused("--simulate --camera mast=knuckle:0.0.0.0:5700", "pictures are not encrypted");
  expect_refused("--simulate --camera mast=knuckle:127.0.0.1:5700 --camera rear=knuckle:127.0.0.1:5700",
                 "--camera rear=knuckle:127.0.0.1:5700: camera mast has this port");
  expect_refused(
      "--connect 127.0.0.1:5683 --insecure --insecure --machine solar015 "
      "--camera mast=knuckle:127.0.0.1:5700 --camera rear=knuckle:0.0.0.0:5700",
      "--camera rear=knuckle:0.0.0.0:5700: camera mast has this port");
  expect_refused("--simulate --camera rear=simulated", "solar015.toml has no [[camera]] of this name");
  expect_refused("--connect 127.0.0.1:5683 --insecure --machine solar015 --camera mast=simulated",
                 "a simulated camera goes with --simulate");
  expect_refused("--simulate --insecure", "--insecure: goes with --connect");
  expect_refused("--simulate --keys /tmp", "--keys /tmp: goes with --connect or --dial");
  expect_refused("--simulate --peer arm", "--peer arm: goes with --dial");
  expect_refused("--simulate --stun stun.example.org:3478", "goes with --dial");
  expect_refused("--simulate --turn turn.example.org:3478", "goes with --dial");
  expect_refused("--connect 127.0.0.1:5683 --insecure --machine solar015 --keys /tmp",
                 "--keys /tmp: does not go with --insecure");
  expect_refused("--dial foo --peer arm --machine solar015", "--dial foo: is not HOST:PORT");
  expect_refused("--simulate --demo --device hid", "--device hid: does not go with --demo");
  expect_refused("--simulate --scenario link_faults", "schedules faults");
  expect_refused("--simulate --demo --scenario recorded_dig_soil", "follows a recorded motion: run it with");
  expect_refused("--simulate --log /tmp --no-log", "--no-log: does not go with --log /tmp");
  expect_refused("--simulate --log /dev/null/log", "--log /dev/null/log: cannot be written: Not a directory");
  expect_refused("--simulate --size 640x480", "1280x720");
  expect_refused("--simulate --screenshot /tmp/s.jpg", "--screenshot /tmp/s.jpg: must end in .png");
  expect_refused("--simulate --scale 9", "--scale");
  expect_refused("--simulate --screen nowhere", "--screen");
  expect_refused("--simulate --device mouse", "--device");
  expect_refused("--simulate --scenario nowhere", "nowhere");
  expect_refused("--simulate --loss 2", "--loss");
}

TEST(ConsoleCommand, RefusesAGamepadThatIsNotThere) {
  const VirtualDisplay display("1280x800");
  if (!display.up()) GTEST_SKIP() << "console: SKIPPED, no Xvfb here (package xvfb)";
  expect_refused("--simulate --device gamepad", "no gamepad found");
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

/// A simulated session behind a real window.
class HostedConsole : public testing::Test {
 protected:
  /// In real time where a person leads, else on virtual time.
  void open(const char* scenario, LiveSession::Led led) {
    if (!display_.up()) GTEST_SKIP() << "console: SKIPPED, no Xvfb here (package xvfb)";
    session::SimulateOptions options;
    options.scenario = scenario;
    host_ = std::make_unique<ConsoleHost>(options, led, nullptr, nullptr);
    real_time_ = led == LiveSession::Led::kByPerson;
    window_ = std::make_unique<ConsoleWindow>(WindowOptions{.full_speed = !real_time_}, canned_facts());
  }
  void frames(int count) {
    for (int i = 0; i < count; ++i) {
      window_->frame(host_->view(), host_->health(), events_, real_time_ ? host_->view_age_s() : 0);
      window_->show();
      host_->put(window_->input(host_->now()));
    }
  }

  VirtualDisplay display_{"1280x800"};
  std::unique_ptr<ConsoleHost> host_;
  std::unique_ptr<ConsoleWindow> window_;
  EventBook events_;
  bool real_time_ = false;
};

/// One that its scenario leads.
class LedConsole : public HostedConsole {
 protected:
  void SetUp() override {
    open("wall_contact", LiveSession::Led::kByScenario);
    if (IsSkipped()) return;
    for (; host_->view().machine.mode != Mode::kEngaged && at_s_ < 20;) run(0.1);
    run(0.5);
    ASSERT_EQ(host_->view().machine.mode, Mode::kEngaged);
  }
  void run(double seconds) { host_->skip_to(at_s_ += seconds); }
  void expect_stopped() {
    run(0.6);
    EXPECT_EQ(host_->view().machine.mode, Mode::kFault);
    EXPECT_EQ(host_->view().machine.fault.code, ReasonCode::kOperatorStop);
    EXPECT_EQ(host_->view().status.valve_command, JointVector(JointVector::Zero()));
    EXPECT_LT(host_->view().status.spool.cwiseAbs().maxCoeff(), 0.05);
  }

  double at_s_ = 0;
};

TEST_F(LedConsole, StopKeyTakesTheMachineToNeutralAndStaysUntilReleased) {
  frames(1);
  ASSERT_TRUE(xdotool("key space"));
  frames(2);
  expect_stopped();
  EXPECT_TRUE(window_->state().stop);
  ASSERT_TRUE(xdotool("key ctrl+BackSpace"));
  frames(2);
  EXPECT_FALSE(window_->state().stop);
}

TEST_F(LedConsole, StopKeyActsWhateverElseIsHeld) {
  for (const char* held : {"ctrl", "shift", "ctrl+shift+alt"}) {
    window_->state().stop = false;
    frames(1);
    ASSERT_TRUE(xdotool(std::string("key ") + held + "+space"));
    frames(2);
    EXPECT_TRUE(window_->state().stop) << held;
  }
}

TEST_F(LedConsole, ASecondClickWhereStopIsDoesNotReleaseIt) {
  for (const int x : {1060, 1150, 1250}) {
    window_->state().stop = false;
    frames(1);
    for (int click = 0; click < 2; ++click) {
      ASSERT_TRUE(xdotool("mousemove " + std::to_string(x) + " 740 mousedown 1"));
      frames(3);
      ASSERT_TRUE(xdotool("mouseup 1"));
      frames(3);
      EXPECT_TRUE(window_->state().stop) << x;
    }
  }
}

TEST_F(LedConsole, EnableHeldWhileItsGamepadWasGoneHasNotBeenPressed) {
  constexpr std::size_t kRightBumper = 5;
  const auto enabled = [this](std::optional<bool> bumper) {
    std::optional<GamepadState> pad;
    if (bumper) pad.emplace().buttons[kRightBumper] = *bumper;
    window_->take_gamepad(pad);
    return window_->input(Time{}).hand.enable;
  };
  EXPECT_FALSE(enabled(true)) << "held from before";
  EXPECT_FALSE(enabled(false));
  EXPECT_TRUE(enabled(true));
  EXPECT_FALSE(enabled(std::nullopt));
  EXPECT_FALSE(enabled(false)) << "plugged in again with the finger on it, not yet reported";
  EXPECT_FALSE(enabled(true));
  EXPECT_FALSE(enabled(false));
  EXPECT_TRUE(enabled(true));
}

TEST_F(LedConsole, StopButtonActsOnEveryScreenWhereItIs) {
  for (int screen = 1; screen <= 6; ++screen) {
    window_->state().stop = false;
    frames(1);
    ASSERT_TRUE(xdotool("key F" + std::to_string(screen) + " mousemove 1150 740 mousedown 1"));
    frames(3);
    EXPECT_TRUE(window_->state().stop) << "screen " << screen;
    ASSERT_TRUE(xdotool("mouseup 1 mousemove 500 5"));
    frames(3);
  }
  expect_stopped();
}

TEST_F(LedConsole, SpaceIsABlankWhileTextIsTypedAndEscIsStop) {
  window_->state().screen = Screen::kEvents;
  frames(1);
  ASSERT_TRUE(xdotool("mousemove 540 140 click 1"));
  frames(3);
  ASSERT_TRUE(xdotool("key a space b"));
  frames(4);
  EXPECT_FALSE(window_->state().stop);
  EXPECT_STREQ(window_->state().events.text.data(), "a b");
  ASSERT_TRUE(xdotool("key Escape"));
  frames(3);
  EXPECT_TRUE(window_->state().stop);
  ASSERT_TRUE(xdotool("mousemove 540 140 click 1"));
  frames(3);
  ASSERT_TRUE(xdotool("key ctrl+BackSpace"));
  frames(3);
  EXPECT_TRUE(window_->state().stop) << "deleting a word must not release it";
}

/// One that a person leads.
class PersonAtConsole : public HostedConsole {
 protected:
  void SetUp() override {
    open("free_motion", LiveSession::Led::kByPerson);
    if (IsSkipped()) return;
    host_->begin();
    ASSERT_TRUE(until(mode_is(Mode::kReady)));
  }
  bool until(const std::function<bool()>& reached) {
    constexpr int kMostFrames = 1800;  // half a minute at least; the pace is the loop's
    for (int i = 0; i < kMostFrames && !reached(); ++i) {
      frames(1);
      if (up_.empty() || !host_->view().input.release_enable) continue;
      // The computer stood still for so long that what is held counts no more: pressed again, as a person would.
      EXPECT_TRUE(xdotool(up_));
      frames(1);
      EXPECT_TRUE(xdotool(down_));
    }
    return reached();
  }
  std::function<bool()> mode_is(Mode mode) {
    return [this, mode] { return host_->view().machine.mode == mode; };
  }
  /// @param down, @param up what takes enable and lets it go.
  void hold(const std::string& down, const std::string& up) {
    down_ = down;
    up_ = up;
    ASSERT_TRUE(xdotool(down));
  }
  void let_go() {
    ASSERT_TRUE(xdotool(std::exchange(up_, "")));
    EXPECT_TRUE(until(mode_is(Mode::kReady))) << "enable was let go of";
  }
  [[nodiscard]] double boom_rad() { return host_->view().machine.position_rad[kBoom]; }

  static constexpr double kSeen_rad = 0.05;
  std::string down_, up_;
};

TEST_F(PersonAtConsole, DrivesByKeys) {
  hold("keydown shift", "keyup shift");
  ASSERT_TRUE(until(mode_is(Mode::kEngaged))) << name(host_->view().machine.blocking.code);
  const double before_rad = boom_rad();
  ASSERT_TRUE(xdotool("keydown q"));
  EXPECT_TRUE(until([&] { return boom_rad() > before_rad + kSeen_rad; }));
  ASSERT_TRUE(xdotool("keyup q"));
  let_go();
}

TEST_F(PersonAtConsole, DrivesByThePointerAlone) {
  ASSERT_TRUE(xdotool("mousemove 540 136 click 1"));  // Hold to run
  ASSERT_TRUE(until([this] { return window_->state().hold_to_run; }));
  const double before_rad = boom_rad();
  hold("mousemove 170 490 mousedown 1", "mouseup 1");  // boom up
  EXPECT_TRUE(until([&] { return boom_rad() > before_rad + kSeen_rad; }));
  EXPECT_EQ(host_->view().machine.mode, Mode::kEngaged);
  let_go();
  hold("mousemove 400 300 mousedown 1", "mouseup 1");  // the tip, somewhere
  EXPECT_TRUE(until(mode_is(Mode::kEngaged)));
  let_go();
}

TEST_F(PersonAtConsole, ThePointerEnablesNothingUnlessItIsMeantTo) {
  ASSERT_TRUE(xdotool("mousemove 400 300 mousedown 1"));
  frames(60);
  EXPECT_TRUE(host_->view().hand.presence);
  EXPECT_FALSE(host_->view().hand.enable);
  ASSERT_TRUE(xdotool("key m"));
  frames(60);
  EXPECT_TRUE(window_->state().hold_to_run);
  EXPECT_FALSE(host_->view().hand.enable) << "turned on while the tip was being pulled";
  ASSERT_TRUE(xdotool("mouseup 1"));
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
