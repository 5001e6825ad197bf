// How soon a window draws again.
#include <gtest/gtest.h>

#include <chrono>

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
    window.end_frame(bell, {});
  }
  EXPECT_GE(std::chrono::steady_clock::now() - begin, kFrames * std::chrono::milliseconds(8));
}

}  // namespace
}  // namespace knuckle::console::window
