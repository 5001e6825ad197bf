// The mouse pulls the tip towards the place under it: that place must not move by anything but the mouse, or an enabled
// machine would run.
#include "tests/console/window/shown_console.h"

namespace knuckle::console::window {
namespace {

class PulledTip : public ShownConsole {
 protected:
  [[nodiscard]] HandInput hand() const { return console_->input(view_.now).hand; }
  /// The button goes down a little beside the requested tip, so that the rate is not a limit's.
  void pull() {
    hover();
    does("mousedown 1");
  }
  void hover() {
    frames(2);
    const Eigen::Vector2d at = seen_at(Kinematics(console_->facts().machine).tip(view_.hand.ghost_rad));
    move_mouse(int(at.x()) + 4, int(at.y()) - 3);
  }
};

TEST_F(PulledTip, StaysWhereItIsPulledToWhateverWouldChangeTheView) {
  click(540, 136);  // Hold to run
  ASSERT_TRUE(state().hold_to_run);
  pull();
  const HandInput before = hand();
  ASSERT_TRUE(before.presence);
  ASSERT_TRUE(before.enable);
  ASSERT_GT(before.rate_radps.norm(), 0);
  for (const char* what : {"key Prior", "key Next", "key z", "click 4", "click 5"}) {
    does(what);
    EXPECT_TRUE(hand().enable) << what;
    EXPECT_EQ(hand().rate_radps, before.rate_radps) << what;
  }
  does("mouseup 1");
  const Pixels still = pixels();
  does("key Prior");
  EXPECT_GT(count_changed(still, pixels(), picture_box()), 5000) << "afterwards the keys act again";
}

TEST_F(PulledTip, IsReleasedWhereThePictureGetsAnotherSizeUnderTheMouseAndDoesNotGoOnByItself) {
  state().hold_to_run = true;
  for (const bool old_size_again : {false, true}) {
    pull();
    ASSERT_TRUE(hand().enable);
    console_->window().change_scale(0.8F);  // larger does not fit into the window
    frames();
    if (old_size_again) {
      console_->window().change_scale(1 / 0.8F);
      frames();
    }
    EXPECT_FALSE(hand().presence);
    EXPECT_FALSE(hand().enable);
    does("mousemove_relative 5 0");
    EXPECT_FALSE(hand().presence) << "until it is pressed anew";
    does("mouseup 1");
    does("mousedown 1");
    EXPECT_TRUE(hand().presence);
    does("mouseup 1");
    if (!old_size_again) console_->window().change_scale(1 / 0.8F);
  }
}

TEST_F(PulledTip, EnablesNothingUnlessItIsMeantTo) {
  pull();
  EXPECT_TRUE(hand().presence);
  EXPECT_FALSE(hand().enable);
  does("key m");
  EXPECT_TRUE(state().hold_to_run);
  EXPECT_FALSE(hand().enable) << "turned on while the tip was being pulled";
}

TEST_F(PulledTip, DoesNotBeginWithAPressThatTurnedTheView) {
  state().hold_to_run = true;
  hover();
  does("key v");
  does("mousedown 1");
  does("key v");  // to the side view, with the button still down
  does("mousemove_relative 5 0");
  EXPECT_FALSE(hand().presence);
  EXPECT_FALSE(hand().enable);
  does("mouseup 1");
  does("mousedown 1");
  EXPECT_TRUE(hand().presence);
}

}  // namespace
}  // namespace knuckle::console::window
