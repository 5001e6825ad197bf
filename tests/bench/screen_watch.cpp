#include "tests/bench/screen_watch.h"

#include <X11/Xlib.h>
#include <X11/Xutil.h>

#include <optional>

#include "tests/bench/stamped_pictures.h"

namespace knuckle {

void ScreenWatch::run() {
  constexpr Duration kLook = 500us;
  Display* display = XOpenDisplay(nullptr);
  std::optional<std::uint32_t> last;
  for (; !ending_; std::this_thread::sleep_for(kLook)) {
    XImage* row = XGetImage(display, DefaultRootWindow(display), where_.left, where_.top + where_.height / 2,
                            static_cast<unsigned>(where_.width), 1, AllPlanes, ZPixmap);
    const Time now = video::now();
    const auto number = StampedPictures::read(
        where_.width, [row](int x) { return static_cast<int>(XGetPixel(row, x, 0) >> 8 & 0xFF); });
    XDestroyImage(row);
    if (!number || number == last) continue;
    last = number;
    seen_(*number, now);
  }
  XCloseDisplay(display);
}

}  // namespace knuckle
