#include "app/console/picture/offscreen.h"

#include <algorithm>

#include "core/error.h"

namespace knuckle::console::picture {

Offscreen::Offscreen(int width_px, int height_px) : width_(width_px), height_(height_px) {
  display_ = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
  if (eglInitialize(display_, nullptr, nullptr) == EGL_FALSE)
    throw InputError("OpenGL without a display is missing: package libgl1-mesa-dri has it");
  eglBindAPI(EGL_OPENGL_API);
  const EGLint wanted[] = {
      EGL_CONTEXT_MAJOR_VERSION,           3,       EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  context_ = eglCreateContext(display_, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, wanted);
  if (eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_FALSE)
    throw InputError("OpenGL 3.3 without a display is missing");
  glGenFramebuffers(1, &frame_);
  glGenRenderbuffers(2, buffers_.data());
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  attach(0, GL_RGBA8, GL_COLOR_ATTACHMENT0);
  attach(1, GL_DEPTH24_STENCIL8, GL_DEPTH_STENCIL_ATTACHMENT);
}

Offscreen::~Offscreen() {
  glDeleteFramebuffers(1, &frame_);
  glDeleteRenderbuffers(2, buffers_.data());
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);
}

std::vector<std::uint8_t> Offscreen::pixels() const {
  std::vector<std::uint8_t> all(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) * 3);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width_, height_, GL_RGB, GL_UNSIGNED_BYTE, all.data());
  return all;
}

void Offscreen::read_from_above(std::uint8_t* rows) const {
  const std::ptrdiff_t row = 4 * static_cast<std::ptrdiff_t>(width_);
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glReadPixels(0, 0, width_, height_, GL_RGBA, GL_UNSIGNED_BYTE, rows);
  for (std::ptrdiff_t low = 0, high = height_ - 1; low < high; ++low, --high)
    std::swap_ranges(rows + low * row, rows + (low + 1) * row, rows + high * row);
}

void Offscreen::attach(std::size_t index, GLenum format, GLenum point) {
  glBindRenderbuffer(GL_RENDERBUFFER, buffers_[index]);
  glRenderbufferStorage(GL_RENDERBUFFER, format, width_, height_);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, point, GL_RENDERBUFFER, buffers_[index]);
}

}  // namespace knuckle::console::picture
