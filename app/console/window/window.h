// One window with an OpenGL 3.3 context and Dear ImGui in it: opening, frames at a steady rate, keys, closing. The
// only file that knows GLFW's loop.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/console/hand_input.h"
#include "app/console/widgets/theme.h"
#include "app/console/window/pad_edges.h"
#include "video/newest.h"

struct GLFWwindow;

namespace knuckle::console::window {

/// The least size that the screens are laid out for, in pixels of the design; their scale gives way down to the
/// smallest one. A window smaller than that has no layout: see Window::too_small().
inline constexpr float kDesignWidth = 1280, kDesignHeight = 720, kSmallestScale = 0.75F;
inline constexpr int kLeastWidth = int(kDesignWidth * kSmallestScale),
                     kLeastHeight = int(kDesignHeight * kSmallestScale);

/// Scale of the content of a window of this size. @param monitor its own scale. @param person chosen, multiplies that;
/// 0: none, and a window of more than twice the design's size enlarges its content by itself.
[[nodiscard]] float content_scale(float width, float height, float monitor, float person) noexcept;

struct WindowOptions {
  std::string title = "Knuckle";
  int width = 1280, height = 800;
  float scale = 0;  ///< The person's, on top of the monitor's; 0: by the window.
  bool light = false;
  bool full_speed = false;  ///< No cap: for measuring.
};

/// A key that went down since the frame before; a tap shorter than a frame is not lost.
struct KeyPress {
  int key = 0;  ///< GLFW_KEY_...
  int modifiers = 0;
};

class Window {
 public:
  /// @throws InputError, one line, where there is no display, no OpenGL 3.3 or no font.
  explicit Window(const WindowOptions& options);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  [[nodiscard]] bool closing() const;
  /// It has the keyboard, which no other program has grabbed, and is not iconified.
  [[nodiscard]] bool attended() const;
  /// Takes events in and opens ImGui's frame.
  void begin_frame();
  /// For any layout, as of this frame: one line is all that is drawn.
  [[nodiscard]] bool too_small() const noexcept { return too_small_; }
  /// Clears the framebuffer; what is drawn between this and end_frame() lies under ImGui's widgets.
  void clear();
  /// Draws ImGui's widgets.
  void draw_widgets();
  /// Takes events in. @return whether the person has pressed, let go of or moved something since the last whole frame,
  /// or holds a mouse button: the next frame has to answer.
  [[nodiscard]] bool touched();
  /// Shows what was drawn: a whole frame, or a picture alone since the last one.
  void swap();
  /// Whole frames take so long that a picture is not to wait for one; but the last one is less than 100 ms ago.
  [[nodiscard]] bool slow() const;
  /// Waits until the next frame is due. A picture that comes is due at once, but no sooner than 8 ms after the last
  /// frame began.
  /// @param next_picture when the next one is expected. A whole frame that would not be done by then waits for the
  /// picture first, at most until 60 ms after the last whole one began.
  void wait(video::Bell& pictures, std::chrono::steady_clock::time_point next_picture);
  /// What has been drawn since clear(), as PNG. @throws InputError where the file cannot be written.
  void write_png(const std::string& path) const;

  [[nodiscard]] const Theme& theme() const noexcept { return theme_; }
  void set_light(bool light);
  /// Times what it is; takes effect with the next frame.
  void change_scale(float by) noexcept { scale_ = by * theme_.scale / monitor_scale_; }
  void toggle_full_screen();

  [[nodiscard]] const std::vector<KeyPress>& key_presses() const noexcept { return presses_; }
  [[nodiscard]] bool key_down(int key) const;
  /// The first one there is; none for once when it is another one than before. A Stop that was pressed since the last
  /// call is pressed, and an enable that was let go of is not, however short it was.
  [[nodiscard]] std::optional<GamepadState> gamepad();
  [[nodiscard]] std::array<int, 2> framebuffer_size() const;
  [[nodiscard]] GLFWwindow* handle() const noexcept { return window_; }

 private:
  static void on_touch(GLFWwindow* window);
  static void on_key(GLFWwindow* window, int key, int scancode, int action, int modifiers);
  void open(const WindowOptions& options);
  void start_widgets();
  void rebuild_fonts();

  GLFWwindow* window_ = nullptr;
  GrabWatch grab_;
  FontFiles font_files_;
  Theme theme_;
  float scale_ = 0, monitor_scale_ = 1;
  bool widgets_started_ = false, full_speed_ = false, grabbed_ = false, too_small_ = false;
  int pad_ = -1;
  PadEdges pad_edges_;
  PadEdges::Edges pad_since_;  ///< Since a state of the gamepad was returned.
  std::vector<KeyPress> presses_, arriving_;
  std::chrono::steady_clock::time_point began_;   ///< The last whole frame.
  std::chrono::nanoseconds took_{};               ///< The last one, until it could be shown.
  std::chrono::steady_clock::time_point polled_;  ///< As a frame began, whole or not.
  bool touched_ = false;                          ///< Since the last whole frame.
  bool whole_ = false;                            ///< Is drawn, and not shown yet.
  std::array<int, 4> windowed_{};                 ///< Place and size before full screen.
};

}  // namespace knuckle::console::window
