// A console's window on a display of the test's own, led by real keys and a real mouse, and its pixels.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "app/console/picture/camera.h"
#include "app/console/picture/gl_program.h"
#include "tests/console/window/canned_console.h"
#include "tests/console/window/drawn_texts.h"
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

/// A red picture of a camera, 16:9, that was captured then.
inline std::unique_ptr<video::Frame> red_frame(Time captured, int width_px = 64, int red = 255) {
  const int height_px = width_px * 9 / 16;
  const auto pixels = std::make_shared<std::vector<std::uint8_t>>(4 * width_px * height_px);
  for (std::size_t i = 0; i < pixels->size(); i += 4) (*pixels)[i] = static_cast<std::uint8_t>(red);
  auto frame = std::make_unique<video::Frame>();
  *frame = {.width_px = width_px,
            .height_px = height_px,
            .row_bytes = 4 * width_px,
            .pixels = pixels->data(),
            .memory = pixels,
            .number = 1,
            .connection = 1};
  frame->captured = frame->received = captured;
  return frame;
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
  /// Of the frame that is drawn and not shown yet.
  [[nodiscard]] Pixels drawn_pixels() const {
    const auto [width, height] = console_->window().framebuffer_size();
    return {width, height, picture::bound_pixels(width, height)};
  }
  /// Of one more frame.
  [[nodiscard]] Pixels pixels() {
    console_->frame(view_, loop_, events_, 0);
    Pixels p = drawn_pixels();
    console_->show();
    return p;
  }
  /// Every text of one more frame.
  [[nodiscard]] std::vector<DrawnText> drawn() {
    std::vector<DrawnText> all = texts_of([this] { ShownConsole::frames(1); });
    std::erase_if(all, [](const DrawnText& text) { return text.text.starts_with("Debug"); });  // ImGui's, never shown
    return all;
  }
  /// Those that have these words in them.
  [[nodiscard]] std::vector<DrawnText> drawn_with(const std::string& words) {
    std::vector<DrawnText> all = drawn();
    std::erase_if(all, [&](const DrawnText& text) { return text.text.find(words) == std::string::npos; });
    return all;
  }
  [[nodiscard]] bool draws(const std::string& words) { return !drawn_with(words).empty(); }
  /// How many texts are just this.
  [[nodiscard]] std::ptrdiff_t draws_exactly(const std::string& words) {
    return std::ranges::count(drawn(), words, &DrawnText::text);
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
  void move_mouse(int x, int y) { does("mousemove " + std::to_string(x) + " " + std::to_string(y)); }
  void resize(int width, int height) {
    does("search --name '^Knuckle$' windowsize " + std::to_string(width) + " " + std::to_string(height));
    for (int i = 0; i < 100 && console_->window().framebuffer_size() != std::array{width, height}; ++i) frames(1);
    ASSERT_EQ(console_->window().framebuffer_size(), (std::array{width, height}));
    frames(2);
  }
  void click(int x, int y) {
    move_mouse(x, y);
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
