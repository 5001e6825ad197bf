// A camera's picture as a texture.
#pragma once

#include <epoxy/gl.h>

#include "app/console/picture/camera.h"
#include "app/console/picture/gl_program.h"
#include "video/frame.h"

namespace knuckle::console::picture {

class VideoView {
 public:
  /// @throws InputError where the driver refuses the shaders. OpenGL 3.3 context current, here and in all the rest.
  VideoView();
  VideoView(const VideoView&) = delete;
  VideoView& operator=(const VideoView&) = delete;
  ~VideoView();

  /// Replaces the picture; its memory is not needed afterwards.
  void upload(const video::Frame& frame);
  /// Width by height of the newest picture; 16:9 before there is one.
  [[nodiscard]] double aspect() const noexcept { return aspect_; }
  [[nodiscard]] int width_px() const noexcept { return width_px_; }
  [[nodiscard]] int height_px() const noexcept { return height_px_; }
  /// Fills the viewport of the bound framebuffer. @param live false: in dark grey. Nothing before there is a picture.
  void draw(const Viewport& viewport, bool live) const;

 private:
  GlProgram program_;
  GLint live_;
  GLuint texture_ = 0, array_ = 0;
  int width_px_ = 0, height_px_ = 0;
  double aspect_ = 16.0 / 9;
};

}  // namespace knuckle::console::picture
