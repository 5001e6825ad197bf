// A gamepad's buttons between two frames.
#include "app/console/window/pad_edges.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/input.h>
#include <unistd.h>

#include <vector>

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
  static input_event of(std::uint16_t type, std::uint16_t code, int value) {
    input_event event{};
    event.type = type;
    event.code = code;
    event.value = value;
    return event;
  }
  void report(const input_event& event) { ASSERT_EQ(write(ends_[1], &event, sizeof event), ssize_t{sizeof event}); }
  void unplug() {
    if (ends_[1] >= 0) close(ends_[1]);
    ends_[1] = -1;
  }
  PadEdges edges_;

 private:
  int ends_[2] = {-1, -1};
};

TEST_F(PadEdgesOfADevice, AreATapOfStopAndEnableLetGoOfEachSeenOnceThoughItIsOverWhenItIsLookedAt) {
  struct Row {
    const char* what;
    std::vector<input_event> reported;
    bool stop_pressed, enable_released;
  };
  const std::vector<Row> rows{
      {"a tap of Stop", {of(EV_KEY, BTN_EAST, 1), of(EV_SYN, SYN_REPORT, 0), of(EV_KEY, BTN_EAST, 0)}, true, false},
      {"enable let go of and pressed again", {of(EV_KEY, BTN_TR, 0), of(EV_KEY, BTN_TR, 1)}, false, true},
      {"the kernel's queue was full", {of(EV_SYN, SYN_DROPPED, 0)}, false, true},
      {"other buttons", {of(EV_KEY, BTN_SOUTH, 1), of(EV_KEY, BTN_NORTH, 1), of(EV_KEY, BTN_TL, 0)}, false, false},
      {"Stop let go of, enable pressed", {of(EV_KEY, BTN_EAST, 0), of(EV_KEY, BTN_TR, 1)}, false, false},
      {"a stick", {of(EV_ABS, ABS_Y, 1)}, false, false}};
  for (const Row& row : rows) {
    for (const input_event& event : row.reported) report(event);
    const PadEdges::Edges edges = edges_.take(), again = edges_.take();
    EXPECT_EQ(edges.stop_pressed, row.stop_pressed) << row.what;
    EXPECT_EQ(edges.enable_released, row.enable_released) << row.what;
    EXPECT_FALSE(again.stop_pressed || again.enable_released) << row.what;
  }
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
