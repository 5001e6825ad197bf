// An OpenGL context without any window, and a picture in memory to draw into.
#pragma once

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <array>
#include <cstdint>
#include <vector>

namespace knuckle::console::picture {

/// Mesa's surfaceless platform: needs no display. Current in the thread that makes it, which also ends it.
class Offscreen {
 public:
  /// @throws InputError where the driver gives no OpenGL 3.3 without a display.
  Offscreen(int width_px, int height_px);
  Offscreen(const Offscreen&) = delete;
  Offscreen& operator=(const Offscreen&) = delete;
  ~Offscreen();

  /// Red, green, blue; rows from below.
  [[nodiscard]] std::vector<std::uint8_t> pixels() const;
  /// Red, green, blue and one more byte. @param rows of 4 * width bytes, from above.
  void read_from_above(std::uint8_t* rows) const;

 private:
  void attach(std::size_t index, GLenum format, GLenum point);

  int width_, height_;
  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
  GLuint frame_ = 0;
  std::array<GLuint, 2> buffers_{};
};

}  // namespace knuckle::console::picture
