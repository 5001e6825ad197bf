#include "app/console/picture/layer.h"

namespace knuckle::console::picture {
namespace {

constexpr const char* kVideoFragmentSource = R"(#version 330 core
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

VideoView::VideoView() : program_(kFourCorners, kVideoFragmentSource), live_(program_.uniform("live")) {
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

namespace {

constexpr const char* kLayerSource = R"(#version 330 core
in vec2 at;
uniform sampler2D layer;
out vec4 pixel;
void main() { pixel = texture(layer, vec2(at.x, 1.0 - at.y)); }
)";

}  // namespace

Layer::Layer() : program_(kFourCorners, kLayerSource) {
  glGenVertexArrays(1, &array_);
  glGenFramebuffers(1, &frame_);
  glGenTextures(1, &colour_);
  glGenRenderbuffers(1, &depth_);
}

Layer::~Layer() {
  glDeleteFramebuffers(1, &frame_);
  glDeleteTextures(1, &colour_);
  glDeleteRenderbuffers(1, &depth_);
  glDeleteVertexArrays(1, &array_);
}

bool Layer::resize(int width_px, int height_px) {
  width_px_ = width_px;
  height_px_ = height_px;
  glBindTexture(GL_TEXTURE_2D, colour_);
  // As the window's own are: copied without being converted.
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width_px, height_px, 0, GL_BGRA, GL_UNSIGNED_INT_8_8_8_8_REV, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glBindTexture(GL_TEXTURE_2D, 0);
  glBindRenderbuffer(GL_RENDERBUFFER, depth_);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH24_STENCIL8, width_px, height_px);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, colour_, 0);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER, depth_);
  return glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

bool Layer::begin(int width_px, int height_px, const Viewport& hole) {
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  if ((width_px != width_px_ || height_px != height_px_) && !resize(width_px, height_px)) {
    width_px_ = height_px_ = 0;  // tried again with the next frame
    end();
    return false;
  }
  hole_ = hole;
  return true;
}

void Layer::cut_hole() const {
  glScissor(hole_.left_px, hole_.bottom_px, hole_.width_px, hole_.height_px);
  glEnable(GL_SCISSOR_TEST);
  glClearColor(0, 0, 0, 0);
  glClear(GL_COLOR_BUFFER_BIT);
  glDisable(GL_SCISSOR_TEST);
}

void Layer::end() const {
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

void Layer::draw_over(const VideoView& video, bool live) const {
  // Copied first, and blended in the hole alone: where the processor draws, blending all of it takes too long.
  glBindFramebuffer(GL_READ_FRAMEBUFFER, frame_);
  glBlitFramebuffer(0, 0, width_px_, height_px_, 0, 0, width_px_, height_px_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, 0);
  video.draw(hole_, live);
  glViewport(0, 0, width_px_, height_px_);
  glScissor(hole_.left_px, hole_.bottom_px, hole_.width_px, hole_.height_px);
  glEnable(GL_SCISSOR_TEST);
  program_.use();
  glBindTexture(GL_TEXTURE_2D, colour_);
  glBindVertexArray(array_);
  glEnable(GL_BLEND);
  // What was drawn into it has been multiplied by its transparency already.
  glBlendFuncSeparate(GL_ONE, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  glDisable(GL_BLEND);
  glDisable(GL_SCISSOR_TEST);
  glBindVertexArray(0);
  glBindTexture(GL_TEXTURE_2D, 0);
}

}  // namespace knuckle::console::picture
