// Whether somebody attends the console's window: what a gamepad or haptic device holds counts only then.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <gtest/gtest.h>

#include "tests/console/window/shown_console.h"
// Last, as it defines common words as macros.
#include <X11/Xlib.h>

namespace knuckle::console::window {
namespace {

class Attention : public ShownConsole {
 protected:
  /// What the window asks for, once what the display was told has come about.
  ConsoleInput input() {
    frames(3);
    return console_->input(Time{});
  }
};

/// Without a window manager, too.
TEST_F(Attention, IsGoneWhileTheKeyboardIsAnothersOrTheWindowOutOfSightButStopOfAGamepadActs) {
  ASSERT_TRUE(input().attended) << "from the start";
  GLFWwindow* const other = glfwCreateWindow(200, 200, "another", nullptr, nullptr);
  glfwFocusWindow(other);
  EXPECT_FALSE(input().attended);
  GamepadState pad;
  pad.buttons[GamepadState::kB] = 1;
  console_->take_gamepad(pad);
  EXPECT_TRUE(input().stop);
  glfwDestroyWindow(other);
  glfwFocusWindow(console_->window().handle());
  EXPECT_TRUE(input().attended);

  Display* const locker = XOpenDisplay(nullptr);  // of the screen
  ASSERT_EQ(XGrabKeyboard(locker, DefaultRootWindow(locker), True, GrabModeAsync, GrabModeAsync, CurrentTime),
            GrabSuccess);
  XSync(locker, False);
  EXPECT_FALSE(input().attended);
  XUngrabKeyboard(locker, CurrentTime);
  XSync(locker, False);
  EXPECT_TRUE(input().attended);
  XCloseDisplay(locker);

  ASSERT_TRUE(xdotool("search --name '^Knuckle$' windowunmap --sync"));
  EXPECT_FALSE(input().attended);
}

TEST_F(Attention, OfTheEnableKeyIsGoneWhileTextIsTypedAndUntilItIsPressedAnew) {
  state().screen = Screen::kEvents;
  (void)input();
  click(520, 140);  // the filter
  ASSERT_TRUE(state().typing);
  EXPECT_FALSE(state().enable_ignored);
  ASSERT_TRUE(xdotool("keydown Shift_L"));
  EXPECT_FALSE(input().hand.enable);
  EXPECT_TRUE(state().enable_ignored);
  click(520, 700);  // the list
  EXPECT_FALSE(state().typing);
  EXPECT_FALSE(input().hand.enable);
  EXPECT_TRUE(state().enable_ignored) << "it was not pressed since";
  ASSERT_TRUE(xdotool("keyup Shift_L") && !input().hand.enable && xdotool("keydown Shift_L"));
  EXPECT_TRUE(input().hand.enable);
  EXPECT_FALSE(state().enable_ignored);
  ASSERT_TRUE(xdotool("keyup Shift_L"));
}

TEST_F(Attention, SpaceIsABlankWhileTextIsTypedAndEscIsStop) {
  state().screen = Screen::kEvents;
  frames();
  click(520, 140);  // the filter
  does("key a space b");
  EXPECT_FALSE(state().stop);
  EXPECT_STREQ(state().events.text.data(), "a b");
  does("key Escape");
  EXPECT_TRUE(state().stop);
  click(520, 140);
  does("key ctrl+BackSpace");
  EXPECT_TRUE(state().stop) << "deleting a word must not release it";
}

/// Up and out are positive.
TEST_F(Attention, EachKeyOfMotionMovesItsJointAloneAndTheWayThatTheHelpSays) {
  const struct {
    const char* key;
    int joint, way;
  } kMotions[]{{"q", kBoom, 1}, {"a", kBoom, -1},  {"w", kArm, 1},
               {"s", kArm, -1}, {"e", kBucket, 1}, {"d", kBucket, -1}};
  for (const auto& motion : kMotions) {
    SCOPED_TRACE(motion.key);
    ASSERT_TRUE(xdotool(std::string("keydown ") + motion.key));
    JointVector rate_radps = input().hand.rate_radps;
    EXPECT_GT(motion.way * rate_radps[motion.joint], 0);
    rate_radps[motion.joint] = 0;
    EXPECT_TRUE(rate_radps.isZero()) << "another joint, too: " << rate_radps.transpose();
    ASSERT_TRUE(xdotool(std::string("keyup ") + motion.key));
    EXPECT_TRUE(input().hand.rate_radps.isZero()) << "let go of";
  }
}

TEST_F(Attention, EnableHeldWhileItsGamepadWasGoneHasNotBeenPressed) {
  const auto enabled = [this](std::optional<bool> bumper) {
    std::optional<GamepadState> pad;
    if (bumper) pad.emplace().buttons[GamepadState::kRightBumper] = *bumper;
    console_->take_gamepad(pad);
    return console_->input(Time{}).hand.enable;
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

}  // namespace
}  // namespace knuckle::console::window
