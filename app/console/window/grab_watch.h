// Whether another program has grabbed the keyboard away from the window that has the focus, as screen lockers and
// window switchers do on X11: GLFW does not tell, and keys that are let go of meanwhile would count as held.
#pragma once

#include <memory>

struct GLFWwindow;
struct _XDisplay;

namespace knuckle::console::window {

class GrabWatch {
 public:
  GrabWatch();
  ~GrabWatch();
  /// Before this nobody has grabbed anything, and for ever where the window is none of X11's.
  void watch(GLFWwindow* window);
  /// Takes in what the display has told since.
  [[nodiscard]] bool grabbed();

 private:
  struct Close {
    void operator()(_XDisplay* display) const;
  };
  std::unique_ptr<_XDisplay, Close> display_;
  bool grabbed_ = false;
};

}  // namespace knuckle::console::window
