// How soon a window draws again.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "app/console/window/window.h"
#include "tests/console/window/virtual_display.h"

namespace knuckle::console::window {
namespace {

TEST(WindowPace, BeginsNoFrameSoonerThan8MsAfterTheOneBeforeHoweverFastPicturesCome) {
  const VirtualDisplay display("640x480");
  if (!display.up()) GTEST_SKIP() << "console: SKIPPED, no Xvfb here (package xvfb)";
  Window window({.width = 200, .height = 200});
  video::Bell bell;
  constexpr int kFrames = 20;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < kFrames; ++i) {
    window.begin_frame();
    window.clear();
    window.draw_widgets();
    bell.ring();
    window.swap();
    window.wait(bell, {});
  }
  EXPECT_GE(std::chrono::steady_clock::now() - begin, kFrames * std::chrono::milliseconds(8));
}

TEST(WindowPace, WaitsForAPictureThatAFrameWouldKeepWaiting) {
  const VirtualDisplay display("640x480");
  if (!display.up()) GTEST_SKIP() << "console: SKIPPED, no Xvfb here (package xvfb)";
  Window window({.width = 200, .height = 200});
  video::Bell bell;
  const auto waited_for = [&](std::chrono::milliseconds takes, std::chrono::milliseconds next_picture) {
    window.begin_frame();
    window.clear();
    window.draw_widgets();
    std::this_thread::sleep_for(takes);
    window.swap();
    const auto begin = std::chrono::steady_clock::now();
    window.wait(bell, begin + next_picture);
    return std::chrono::steady_clock::now() - begin;
  };
  using std::chrono::milliseconds;
  // Never longer than until 60 ms after the frame began: not at all where the computer was busy with others.
  const auto longest_of = [&](std::chrono::milliseconds next_picture) {
    std::chrono::nanoseconds longest{};
    for (int i = 0; i < 20 && longest < next_picture + milliseconds(7); ++i)
      longest = std::max<std::chrono::nanoseconds>(longest, waited_for(milliseconds(20), next_picture));
    return longest;
  };
  EXPECT_GE(longest_of(milliseconds(12)), milliseconds(19)) << "the next frame would take until long after it";
  EXPECT_GE(longest_of(milliseconds(0)), milliseconds(7)) << "it is late, and may come yet";
}

}  // namespace
}  // namespace knuckle::console::window
