// Whether somebody attends the console's window: what a gamepad or haptic device holds counts only then.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <gtest/gtest.h>

#include "app/console/screens/screens.h"
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

TEST_F(Attention, IsThereFromTheStartWithoutAWindowManager) {
  EXPECT_TRUE(input().attended);
}

TEST_F(Attention, IsGoneWhileAnotherWindowHasTheKeyboardButStopOfAGamepadActs) {
  constexpr std::size_t kB = GamepadState::kB;
  GLFWwindow* const other = glfwCreateWindow(200, 200, "another", nullptr, nullptr);
  glfwFocusWindow(other);
  EXPECT_FALSE(input().attended);
  GamepadState pad;
  pad.buttons[kB] = 1;
  console_->take_gamepad(pad);
  EXPECT_TRUE(input().stop);
  glfwDestroyWindow(other);
  glfwFocusWindow(console_->window().handle());
  EXPECT_TRUE(input().attended);
}

TEST_F(Attention, IsGoneWhileAScreenLockerHasGrabbedTheKeyboard) {
  ASSERT_TRUE(input().attended);
  Display* const locker = XOpenDisplay(nullptr);
  ASSERT_EQ(XGrabKeyboard(locker, DefaultRootWindow(locker), True, GrabModeAsync, GrabModeAsync, CurrentTime),
            GrabSuccess);
  XSync(locker, False);
  EXPECT_FALSE(input().attended);
  XUngrabKeyboard(locker, CurrentTime);
  XSync(locker, False);
  EXPECT_TRUE(input().attended);
  XCloseDisplay(locker);
}

TEST_F(Attention, IsGoneWhileTheWindowIsOutOfSight) {
  ASSERT_TRUE(input().attended);
  ASSERT_TRUE(xdotool("search --name '^Knuckle$' windowunmap --sync"));
  EXPECT_FALSE(input().attended);
}

TEST(AttentionText, ThatIsMissingIsSaidInTheBannerWithWhatToDo) {
  ConsoleView view = canned_view();
  view.machine = {};
  view.input.unattended = true;
  EXPECT_NE(screens::banner_reason(view, false, 0).find("click into it"), std::string::npos);
  EXPECT_EQ(screens::banner_reason(view, true, 0).rfind("Stop", 0), 0U) << "Stop comes first";
}

TEST_F(Attention, OfTheEnableKeyIsGoneWhileTextIsTypedAndUntilItIsPressedAnew) {
  console_->state().screen = Screen::kEvents;
  (void)input();
  click(520, 140);  // the filter
  ASSERT_TRUE(console_->state().typing);
  EXPECT_FALSE(console_->state().enable_ignored);
  ASSERT_TRUE(xdotool("keydown Shift_L"));
  EXPECT_FALSE(input().hand.enable);
  EXPECT_TRUE(console_->state().enable_ignored);
  click(520, 700);  // the list
  EXPECT_FALSE(console_->state().typing);
  EXPECT_FALSE(input().hand.enable);
  EXPECT_TRUE(console_->state().enable_ignored) << "it was not pressed since";
  ASSERT_TRUE(xdotool("keyup Shift_L") && !input().hand.enable && xdotool("keydown Shift_L"));
  EXPECT_TRUE(input().hand.enable);
  EXPECT_FALSE(console_->state().enable_ignored);
  ASSERT_TRUE(xdotool("keyup Shift_L"));
}

}  // namespace
}  // namespace knuckle::console::window
