#include "app/console/picture/video_view.h"

namespace knuckle::console::picture {
namespace {

constexpr const char* kFragmentSource = R"(#version 330 core
in vec2 at;
uniform sampler2D picture;
uniform float live;
out vec4 pixel;
void main() {
  vec3 colour = texture(picture, at).rgb;
  float grey = 0.45 * dot(colour, vec3(0.2126, 0.7152, 0.0722)) + 0.08;
  pixel = vec4(mix(vec3(grey), colour, live), 1.0);
}
)";

}  // namespace

VideoView::VideoView() : program_(kFourCorners, kFragmentSource), live_(program_.uniform("live")) {
  glGenVertexArrays(1, &array_);
  glGenTextures(1, &texture_);
  glBindTexture(GL_TEXTURE_2D, texture_);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glBindTexture(GL_TEXTURE_2D, 0);
}

VideoView::~VideoView() {
  glDeleteTextures(1, &texture_);
  glDeleteVertexArrays(1, &array_);
}

void VideoView::upload(const video::Frame& frame) {
  constexpr int kBytes = 4;
  glBindTexture(GL_TEXTURE_2D, texture_);
  glPixelStorei(GL_UNPACK_ALIGNMENT, kBytes);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, frame.row_bytes / kBytes);
  if (frame.width_px != width_px_ || frame.height_px != height_px_) {
    width_px_ = frame.width_px;
    height_px_ = frame.height_px;
    aspect_ = static_cast<double>(width_px_) / height_px_;
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width_px_, height_px_, 0, GL_RGBA, GL_UNSIGNED_BYTE, frame.pixels);
  } else {
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width_px_, height_px_, GL_RGBA, GL_UNSIGNED_BYTE, frame.pixels);
  }
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  glBindTexture(GL_TEXTURE_2D, 0);
}

void VideoView::draw(const Viewport& viewport, bool live) const {
  if (width_px_ == 0) return;
  glViewport(viewport.left_px, viewport.bottom_px, viewport.width_px, viewport.height_px);
  program_.use();
  glUniform1f(live_, live ? 1.0F : 0.0F);
  glBindTexture(GL_TEXTURE_2D, texture_);
  glBindVertexArray(array_);
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  glBindVertexArray(0);
  glBindTexture(GL_TEXTURE_2D, 0);
}

}  // namespace knuckle::console::picture
