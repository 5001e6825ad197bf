// What was pressed and let go of on gamepads between two frames of the window: GLFW says only what is held when it
// looks, and a tap of Stop during a long frame would be lost.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "app/console/hand_input.h"

struct GLFWwindow;
struct _XDisplay;

namespace knuckle::console::window {

class PadEdges {
 public:
  struct Edges {
    bool stop_pressed = false;     ///< B
    bool enable_released = false;  ///< Right bumper
  };

  PadEdges() = default;
  ~PadEdges();
  PadEdges(const PadEdges&) = delete;
  PadEdges& operator=(const PadEdges&) = delete;

  /// Opens all gamepads that are not open yet and whose driver names the buttons by their place, as those of Xbox pads
  /// do. Others have no edges: of them only GLFW's list knows which button is which.
  void look();
  /// The same with a device that is open already, under a name of its own.
  void add(const std::string& path, int fd);
  /// Of all of them since the last call. Never waits.
  [[nodiscard]] Edges take() noexcept;

 private:
  std::map<std::string, int> open_;
};

/// What is held, and what was pressed or let go of meanwhile: a Stop that was pressed is pressed, an enable that was
/// let go of is not.
[[nodiscard]] GamepadState with(const PadEdges::Edges& edges, GamepadState held) noexcept;

// Whether another program has grabbed the keyboard away from the window that has the focus, as screen lockers and
// window switchers do on X11: GLFW does not report it, and keys released meanwhile would count as held.

class GrabWatch {
 public:
  GrabWatch();
  ~GrabWatch();
  /// Before this nothing is grabbed, and never where the window is not one of X11.
  void watch(GLFWwindow* window);
  /// Takes in the display's events since then.
  [[nodiscard]] bool grabbed();

 private:
  struct Close {
    void operator()(_XDisplay* display) const;
  };
  std::unique_ptr<_XDisplay, Close> display_;
  bool grabbed_ = false;
};

}  // namespace knuckle::console::window
