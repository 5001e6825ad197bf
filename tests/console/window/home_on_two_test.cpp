// The button for going home on two: there only while that is offered, and no longer pressed than it is held.
#include "tests/console/window/shown_console.h"

namespace knuckle::console::window {
namespace {

class HomeButton : public ShownConsole {
 protected:
  void offer() {
    view_.machine.mode = Mode::kFault;
    view_.machine.fault = {ReasonCode::kSensorStale, 0x20, 60, 50};
    view_.machine.blocking = {ReasonCode::kHomeOffered, kBoom, 0, 0};
    view_.machine.home_offered = true;
    frames();
  }
};

TEST_F(HomeButton, AsksForAsLongAsItIsHeldAndOnlyWhereItIsOffered) {
  EXPECT_FALSE(draws("Home on two"));
  offer();
  const std::vector<DrawnText> buttons = drawn_with("Home on two");
  ASSERT_EQ(buttons.size(), 1U);
  move_mouse(int(buttons[0].min.x) + 20, int(buttons[0].min.y) + 8);
  EXPECT_FALSE(console_->input(Time{}).home) << "the pointer is over it, no more";
  does("mousedown 1");
  EXPECT_TRUE(console_->input(Time{}).home);
  view_.hand.home_asked = 0.7;
  frames();
  EXPECT_TRUE(console_->input(Time{}).home);
  view_.machine.home_offered = false;  // the machine has taken it
  frames();
  EXPECT_FALSE(console_->input(Time{}).home);
  does("mouseup 1");
  offer();
  EXPECT_FALSE(console_->input(Time{}).home);
}

TEST_F(HomeButton, IsNotThereWhereTheMachineIsNotHeard) {
  offer();
  view_.link.silence_s = 2;
  frames();
  EXPECT_FALSE(draws("Home on two"));
}

TEST_F(HomeButton, AMachineOnItsWayHomeIsAmberAllTheTime) {
  for (const Mode mode : {Mode::kReady, Mode::kEngaged, Mode::kFault}) {
    view_.machine.mode = mode;
    view_.machine.home_on_two = true;
    frames();
    EXPECT_EQ(draws_exactly("HOME ON TWO"), 1) << name(mode);
  }
}

}  // namespace
}  // namespace knuckle::console::window
