#include "app/console/window/grab_watch.h"

#include <X11/Xlib.h>
#include <dlfcn.h>

namespace knuckle::console::window {

GrabWatch::GrabWatch() = default;
GrabWatch::~GrabWatch() = default;

void GrabWatch::Close::operator()(_XDisplay* display) const {
  XCloseDisplay(display);
}

void GrabWatch::watch(GLFWwindow* window) {
  // Debian's GLFW for Wayland lacks both.
  const auto window_of = reinterpret_cast<::Window (*)(GLFWwindow*)>(dlsym(RTLD_DEFAULT, "glfwGetX11Window"));
  const auto display_of = reinterpret_cast<Display* (*)()>(dlsym(RTLD_DEFAULT, "glfwGetX11Display"));
  if (window_of == nullptr || display_of == nullptr) return;
  XSync(display_of(), False);             // until then the window may be known to GLFW only
  display_.reset(XOpenDisplay(nullptr));  // a connection of its own: GLFW takes what comes on its own
  if (!display_) return;
  XSelectInput(display_.get(), window_of(window), FocusChangeMask);
  XSync(display_.get(), False);  // as long as the window is there
}

bool GrabWatch::grabbed() {
  while (display_ && XPending(display_.get()) > 0) {
    XEvent event;
    XNextEvent(display_.get(), &event);
    if (event.type == FocusOut && event.xfocus.mode == NotifyGrab) grabbed_ = true;
    // Also where the focus went elsewhere during the grab and comes back after it.
    if (event.type == FocusIn && (event.xfocus.mode == NotifyUngrab || event.xfocus.mode == NotifyNormal))
      grabbed_ = false;
  }
  return grabbed_;
}

}  // namespace knuckle::console::window
