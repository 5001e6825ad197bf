// A pixel of the display, as a person sees it, whichever program has drawn it.
#pragma once

#include <array>

struct _XDisplay;

namespace knuckle::console::window {

class ScreenPixel {
 public:
  /// From the display's upper left corner. DISPLAY names it.
  ScreenPixel(int x, int y);
  ~ScreenPixel();
  ScreenPixel(const ScreenPixel&) = delete;
  ScreenPixel& operator=(const ScreenPixel&) = delete;

  /// Red, green, blue.
  [[nodiscard]] std::array<int, 3> look() const;

 private:
  _XDisplay* const display_;
  const int x_, y_;
};

}  // namespace knuckle::console::window
