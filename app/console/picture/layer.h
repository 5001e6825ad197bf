// All that is on the screen around and over a camera's picture: drawn once, shown with as many pictures as come.
#pragma once

#include <epoxy/gl.h>

#include "app/console/picture/camera.h"
#include "app/console/picture/gl_program.h"
#include "video/frame.h"

namespace knuckle::console::picture {

// A camera's picture as a texture.

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

class Layer {
 public:
  /// @throws InputError where the driver refuses the shaders. OpenGL 3.3 context current, here and in all the rest.
  Layer();
  Layer(const Layer&) = delete;
  Layer& operator=(const Layer&) = delete;
  ~Layer();

  /// From here until end(), what is drawn goes into the layer instead of the window. @param hole of the window, where
  /// the picture will be. @return false: the graphics memory has no room for it, and nothing has changed.
  [[nodiscard]] bool begin(int width_px, int height_px, const Viewport& hole);
  /// Empties the hole: what is drawn there from now on lies over the picture.
  void cut_hole() const;
  void end() const;
  /// Fills the window: with the layer, and the picture in its hole. @param live as VideoView::draw().
  void draw_over(const VideoView& video, bool live) const;

 private:
  [[nodiscard]] bool resize(int width_px, int height_px);

  GlProgram program_;
  GLuint frame_ = 0, colour_ = 0, depth_ = 0, array_ = 0;
  int width_px_ = 0, height_px_ = 0;
  Viewport hole_;
};

}  // namespace knuckle::console::picture
