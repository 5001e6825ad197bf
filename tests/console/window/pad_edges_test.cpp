// A gamepad's buttons between two frames.
#include "app/console/window/pad_edges.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/input.h>
#include <unistd.h>

namespace knuckle::console::window {
namespace {

/// A device that the test plays the kernel of.
class PadEdgesOfADevice : public testing::Test {
 protected:
  PadEdgesOfADevice() {
    EXPECT_EQ(pipe2(ends_, O_NONBLOCK | O_CLOEXEC), 0);
    edges_.add("pad", ends_[0]);
  }
  ~PadEdgesOfADevice() override { unplug(); }
  void reports(std::uint16_t type, std::uint16_t code, int value) {
    input_event event{};
    event.type = type;
    event.code = code;
    event.value = value;
    ASSERT_EQ(write(ends_[1], &event, sizeof event), ssize_t{sizeof event});
  }
  void unplug() {
    if (ends_[1] >= 0) close(ends_[1]);
    ends_[1] = -1;
  }
  PadEdges edges_;

 private:
  int ends_[2] = {-1, -1};
};

TEST_F(PadEdgesOfADevice, TapOfStopIsSeenOnceThoughItIsOverWhenItIsLookedAt) {
  reports(EV_KEY, BTN_EAST, 1);
  reports(EV_SYN, SYN_REPORT, 0);
  reports(EV_KEY, BTN_EAST, 0);
  reports(EV_SYN, SYN_REPORT, 0);
  const PadEdges::Edges edges = edges_.take();
  EXPECT_TRUE(edges.stop_pressed);
  EXPECT_FALSE(edges.enable_released);
  EXPECT_FALSE(edges_.take().stop_pressed);
}

TEST_F(PadEdgesOfADevice, EnableLetGoOfAndPressedAgainIsSeenAsLetGoOf) {
  reports(EV_KEY, BTN_TR, 0);
  reports(EV_KEY, BTN_TR, 1);
  EXPECT_TRUE(edges_.take().enable_released);
  EXPECT_FALSE(edges_.take().enable_released);
}

TEST_F(PadEdgesOfADevice, OtherButtonsAndSticksAreNone) {
  for (const std::uint16_t button : std::initializer_list<std::uint16_t>{BTN_SOUTH, BTN_NORTH, BTN_WEST, BTN_TL}) {
    reports(EV_KEY, button, 1);
    reports(EV_KEY, button, 0);
  }
  reports(EV_KEY, BTN_EAST, 0);
  reports(EV_KEY, BTN_TR, 1);
  reports(EV_ABS, ABS_Y, 1);
  const PadEdges::Edges edges = edges_.take();
  EXPECT_FALSE(edges.stop_pressed);
  EXPECT_FALSE(edges.enable_released);
}

TEST_F(PadEdgesOfADevice, EnableIsTakenForLetGoOfWhereTheKernelsQueueWasFull) {
  reports(EV_SYN, SYN_DROPPED, 0);
  EXPECT_TRUE(edges_.take().enable_released);
}

TEST_F(PadEdgesOfADevice, DeviceThatIsGoneIsAskedNoMore) {
  unplug();
  EXPECT_FALSE(edges_.take().stop_pressed);
  EXPECT_FALSE(edges_.take().stop_pressed);
}

TEST(PadEdges, CountBesideWhatIsHeld) {
  GamepadState held;
  held.buttons[GamepadState::kRightBumper] = held.buttons[GamepadState::kA] = 1;
  EXPECT_EQ(with({}, held).buttons, held.buttons);
  const GamepadState tapped = with({.stop_pressed = true}, held);
  EXPECT_NE(tapped.buttons[GamepadState::kB], 0);
  EXPECT_NE(tapped.buttons[GamepadState::kRightBumper], 0);
  const GamepadState let_go = with({.enable_released = true}, held);
  EXPECT_EQ(let_go.buttons[GamepadState::kRightBumper], 0);
  EXPECT_NE(let_go.buttons[GamepadState::kA], 0);
}

TEST(PadEdges, NoGamepadHasNoEdges) {
  PadEdges edges;
  edges.look();
  const PadEdges::Edges none = edges.take();
  EXPECT_FALSE(none.stop_pressed);
  EXPECT_FALSE(none.enable_released);
}

}  // namespace
}  // namespace knuckle::console::window
