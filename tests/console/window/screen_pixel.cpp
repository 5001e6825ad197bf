#include "tests/console/window/screen_pixel.h"

#include <X11/Xlib.h>
#include <X11/Xutil.h>

namespace knuckle::console::window {

ScreenPixel::ScreenPixel(int x, int y) : display_(XOpenDisplay(nullptr)), x_(x), y_(y) {}

ScreenPixel::~ScreenPixel() {
  if (display_ != nullptr) XCloseDisplay(display_);
}

std::array<int, 3> ScreenPixel::look() const {
  XImage* image = XGetImage(display_, DefaultRootWindow(display_), x_, y_, 1, 1, AllPlanes, ZPixmap);
  const unsigned long pixel = XGetPixel(image, 0, 0);
  XDestroyImage(image);
  const auto byte = [pixel](int shift) { return static_cast<int>(pixel >> shift & 0xFF); };
  return {byte(16), byte(8), byte(0)};
}

}  // namespace knuckle::console::window
