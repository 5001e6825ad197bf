// Calibration led by a person with a mouse: real clicks in a real window, up to the first motion and its end.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>

#include "tests/console/window/canned_console.h"
#include "tests/console/window/keyboard_walk.h"
#include "tests/console/window/virtual_display.h"

namespace knuckle::console::window {
namespace {

namespace fs = std::filesystem;

class CalibrateScreen : public testing::Test {
 protected:
  void SetUp() override {
    display_ = std::make_unique<VirtualDisplay>("1280x800");
    if (!display_->up()) GTEST_SKIP() << "console: SKIPPED, no Xvfb here (package xvfb)";
    std::string folder = (fs::temp_directory_path() / "knuckle_calibrate_XXXXXX").string();
    ASSERT_NE(mkdtemp(folder.data()), nullptr);
    folder_ = folder;
    console_ = std::make_unique<ConsoleWindow>(WindowOptions{.width = 1280, .height = 800, .full_speed = true},
                                               canned_facts());
    console_->hold_steady();
    console_->state().screen = screens::Screen::kCalibrate;
    console_->calibration().plan.target = (folder_ / "calibrated.toml").string();
    console_->calibration().plan.pace = 0;
  }
  void TearDown() override {
    console_.reset();
    fs::remove_all(folder_);
  }
  void frames(int n) {
    for (int i = 0; i < n; ++i) {
      console_->frame(view_, loop_, events_, 0);
      console_->show();
    }
  }
  void click(int x, int y) {
    frames(1);
    ASSERT_TRUE(xdotool("mousemove " + std::to_string(x) + " " + std::to_string(y)));
    frames(2);
    ASSERT_TRUE(xdotool("mousedown 1"));
    frames(2);
    ASSERT_TRUE(xdotool("mouseup 1"));
    frames(2);
  }
  /// Into the field of a number, and Enter.
  void type(const std::string& number) {
    click(kFirstWordX, kWordsY);
    for (const char digit : number) {
      ASSERT_TRUE(xdotool(std::string("key ") + digit));
      frames(2);
    }
    for (const char* step : {"keydown Return", "keyup Return"}) {
      ASSERT_TRUE(xdotool(step));
      frames(2);
    }
  }
  /// First word of the question that is there after some frames; empty for a number, or where the job is over.
  std::string asked_word() {
    const CalibrationState& state = asked();
    return state.question && !state.question->words.empty() ? state.question->words.front() : "";
  }
  const CalibrationState& asked() {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    const screens::CalibrationPanel& panel = console_->calibration();
    while (panel.running() && !panel.state().question && std::chrono::steady_clock::now() < end) frames(1);
    return panel.state();
  }
  void picture(const char* name) {
    console_->frame(view_, loop_, events_, 0);
    console_->write_png((fs::temp_directory_path() / name).string());
  }

  static constexpr int kBeginX = 494, kBeginY = 235, kFirstWordX = 438, kWordsY = 758, kStopX = 1152, kStopY = 742;
  std::unique_ptr<VirtualDisplay> display_;
  fs::path folder_;
  std::unique_ptr<ConsoleWindow> console_;
  ConsoleView view_ = canned_view();
  LoopHealth loop_ = canned_loop();
  EventBook events_;
};

TEST_F(CalibrateScreen, IsLedByButtonsAndEndedByStop) {
  click(kBeginX, kBeginY);
  ASSERT_TRUE(console_->calibration().running()) << console_->calibration().problem();
  EXPECT_EQ(asked_word(), "ready");
  for (const char* word : {"ready", "configure", "pressed", "released"}) {
    ASSERT_EQ(asked_word(), word);
    click(kFirstWordX, kWordsY);
  }
  ASSERT_TRUE(asked().question.value().bounds) << "the slope by a spirit level";
  picture("knuckle-console-calibrate-number.png");
  type("99");
  ASSERT_TRUE(console_->calibration().running()) << console_->calibration().state().outcome;
  ASSERT_TRUE(console_->calibration().state().question) << "a number out of its bounds answers nothing";
  EXPECT_EQ(console_->calibration().refused(), "99 is not within -30 to 30 degrees: enter another value");
  picture("knuckle-console-calibrate-refused.png");
  type("0");
  EXPECT_EQ(console_->calibration().refused(), "");
  for (const char* word : {"pilot", "move", "go", "longer"}) {
    ASSERT_EQ(asked_word(), word) << console_->calibration().state().outcome;
    if (std::string(word) == "longer") picture("knuckle-console-calibrate-signs.png");
    click(kFirstWordX, kWordsY);
  }
  (void)asked();
  ASSERT_TRUE(console_->calibration().running()) << console_->calibration().state().outcome;
  click(kStopX, kStopY);
  EXPECT_TRUE(console_->state().stop);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (console_->calibration().running() && std::chrono::steady_clock::now() < end) frames(1);
  EXPECT_EQ(console_->calibration().state().outcome, "ended, nothing was changed: cancelled");
  picture("knuckle-console-calibrate-over.png");
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(CalibrateScreen, IsLedByTheKeyboardAlone) {
  const KeyboardWalk walk([this](int count) { frames(count); });
  const auto press = [&walk](const std::string& name) {
    ASSERT_TRUE(walk.go_to(name)) << name;
    walk.press("Return");
  };
  frames(3);
  press("Begin");
  for (const char* word : {"ready", "configure", "pressed", "released"}) {
    ASSERT_EQ(asked_word(), word);
    EXPECT_EQ(walk.missed(), "") << word;
    press(word);
  }
  ASSERT_TRUE(asked().question.value().bounds) << "the slope by a spirit level";
  press("##number");
  ASSERT_TRUE(xdotool("key 0"));
  frames(2);
  EXPECT_EQ(walk.missed(), "") << "of a number that is typed";
  press("Enter");
  ASSERT_EQ(asked_word(), "pilot") << console_->calibration().refused();
  press("End, valves closed");
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (console_->calibration().running() && std::chrono::steady_clock::now() < end) frames(1);
  EXPECT_EQ(console_->calibration().state().outcome, "ended, nothing was changed: cancelled");
}

}  // namespace
}  // namespace knuckle::console::window
