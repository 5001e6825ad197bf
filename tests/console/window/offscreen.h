// An OpenGL context without any window, and a picture in memory to draw into.
#pragma once

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <cstdint>
#include <stdexcept>
#include <vector>

namespace knuckle::console::window {

/// Mesa's surfaceless platform: needs no display. Current from construction on.
class Offscreen {
 public:
  Offscreen(int width_px, int height_px) : width_(width_px), height_(height_px) {
    display_ = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    if (eglInitialize(display_, nullptr, nullptr) == EGL_FALSE) throw std::runtime_error("no EGL without a display");
    eglBindAPI(EGL_OPENGL_API);
    const EGLint wanted[] = {
        EGL_CONTEXT_MAJOR_VERSION,           3,       EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
    context_ = eglCreateContext(display_, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, wanted);
    if (eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_FALSE)
      throw std::runtime_error("no OpenGL 3.3");
    glGenFramebuffers(1, &frame_);
    glGenRenderbuffers(2, buffers_);
    glBindFramebuffer(GL_FRAMEBUFFER, frame_);
    attach(0, GL_RGBA8, GL_COLOR_ATTACHMENT0);
    attach(1, GL_DEPTH24_STENCIL8, GL_DEPTH_STENCIL_ATTACHMENT);
  }
  Offscreen(const Offscreen&) = delete;
  Offscreen& operator=(const Offscreen&) = delete;
  ~Offscreen() {
    glDeleteFramebuffers(1, &frame_);
    glDeleteRenderbuffers(2, buffers_);
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display_, context_);
  }

  /// Red, green, blue; rows from below.
  [[nodiscard]] std::vector<std::uint8_t> pixels() const {
    std::vector<std::uint8_t> all(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) * 3);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(0, 0, width_, height_, GL_RGB, GL_UNSIGNED_BYTE, all.data());
    return all;
  }

 private:
  void attach(int index, GLenum format, GLenum point) {
    glBindRenderbuffer(GL_RENDERBUFFER, buffers_[index]);
    glRenderbufferStorage(GL_RENDERBUFFER, format, width_, height_);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, point, GL_RENDERBUFFER, buffers_[index]);
  }
  int width_, height_;
  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
  GLuint frame_ = 0, buffers_[2]{};
};

}  // namespace knuckle::console::window
