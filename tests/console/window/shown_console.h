// A console's window on a display of the test's own, led by real keys and a real mouse, and its pixels.
#pragma once

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "app/console/picture/camera.h"
#include "tests/console/window/canned_console.h"
#include "tests/console/window/virtual_display.h"

namespace knuckle::console::window {

/// Three bytes each, rows from below.
struct Pixels {
  int width = 0, height = 0;
  std::vector<std::uint8_t> bytes;
  /// @param x, @param y from the upper left corner.
  [[nodiscard]] const std::uint8_t* at(int x, int y) const {
    return &bytes[3 * (static_cast<std::size_t>(height - 1 - y) * static_cast<std::size_t>(width) +
                       static_cast<std::size_t>(x))];
  }
  [[nodiscard]] bool near(int x, int y, ImU32 colour, int tolerance = 6) const {
    const std::uint8_t* p = at(x, y);
    for (int i = 0; i < 3; ++i)
      if (std::abs(p[i] - static_cast<int>(colour >> (8 * i) & 0xFF)) > tolerance) return false;
    return true;
  }
};
struct Box {
  int left, top, right, bottom;
};
[[nodiscard]] inline int count_near(const Pixels& pixels, const Box& box, ImU32 colour) {
  int count = 0;
  for (int y = box.top; y < box.bottom; ++y)
    for (int x = box.left; x < box.right; ++x) count += pixels.near(x, y, colour) ? 1 : 0;
  return count;
}
[[nodiscard]] inline int count_changed(const Pixels& a, const Pixels& b, const Box& box) {
  int count = 0;
  for (int y = box.top; y < box.bottom; ++y)
    for (int x = box.left; x < box.right; ++x) {
      const std::uint8_t *p = a.at(x, y), *q = b.at(x, y);
      count += std::abs(p[0] - q[0]) + std::abs(p[1] - q[1]) + std::abs(p[2] - q[2]) > 20 ? 1 : 0;
    }
  return count;
}

class ShownConsole : public testing::Test {
 protected:
  void SetUp() override {
    if (!display_.up()) GTEST_SKIP() << "console: SKIPPED, no Xvfb here (package xvfb)";
    console_ = std::make_unique<ConsoleWindow>(WindowOptions{.width = 1280, .height = 800, .full_speed = true},
                                               canned_facts());
    console_->hold_steady();
    console_->show_recording(canned_recording());
    fill(events_, console_->facts().machine.bus);
    frames();
  }
  void frames(int count = 4) {
    for (int i = 0; i < count; ++i) {
      console_->frame(view_, loop_, events_, 0);
      console_->show();
    }
  }
  /// One more frame, not shown yet.
  [[nodiscard]] Pixels pixels() {
    console_->frame(view_, loop_, events_, 0);
    const auto [width, height] = console_->window().framebuffer_size();
    Pixels p{
        width, height,
        std::vector<std::uint8_t>(std::size_t{3} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height))};
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(0, 0, p.width, p.height, GL_RGB, GL_UNSIGNED_BYTE, p.bytes.data());
    console_->show();
    return p;
  }
  /// @param words for xdotool.
  void does(const std::string& words) {
    ASSERT_TRUE(xdotool(words));
    frames();
  }
  /// A key for ImGui itself, which does not see one that is shorter than a frame.
  void press(const std::string& key, int frames_held = 2) {
    ASSERT_TRUE(xdotool("keydown " + key));
    frames(frames_held);
    ASSERT_TRUE(xdotool("keyup " + key));
    frames(2);
  }
  void click(int x, int y) {
    does("mousemove " + std::to_string(x) + " " + std::to_string(y));
    does("mousedown 1");
    does("mouseup 1");
  }
  /// Where a point of the arm's plane is on the screen, before anything was zoomed.
  [[nodiscard]] Eigen::Vector2d seen_at(const PlanarVector& at_m) const {
    const Area area = console_->machine_picture().value();
    const auto pixel = picture::pixel_of(picture::side_camera(console_->facts().machine), picture::viewport_of(area),
                                         {at_m.x(), 0, at_m.y()});
    return Eigen::Vector2d(double(area.min.x), double(area.min.y)) + *pixel;
  }
  /// The machine's picture, without its border.
  [[nodiscard]] Box picture_box() const {
    const Area area = console_->machine_picture().value();
    return {int(area.min.x) + 2, int(area.min.y) + 2, int(area.max.x) - 2, int(area.max.y) - 2};
  }
  [[nodiscard]] screens::UiState& state() { return console_->state(); }
  [[nodiscard]] const Theme& theme() { return console_->window().theme(); }

  VirtualDisplay display_{"1280x800"};
  std::unique_ptr<ConsoleWindow> console_;
  ConsoleView view_ = canned_view();
  LoopHealth loop_ = canned_loop();
  EventBook events_;
};

}  // namespace knuckle::console::window
