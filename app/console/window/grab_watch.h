// Whether another program has grabbed the keyboard away from the window that has the focus, as screen lockers and
// window switchers do on X11: GLFW does not report it, and keys released meanwhile would count as held.
#pragma once

#include <memory>

struct GLFWwindow;
struct _XDisplay;

namespace knuckle::console::window {

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
