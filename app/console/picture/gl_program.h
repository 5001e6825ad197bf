// What OpenGL owns, released with its owner: a program and meshes in the graphics memory. Context current throughout.
#pragma once

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "app/console/picture/mesh.h"

namespace knuckle::console::picture {

class GlProgram {
 public:
  /// @throws InputError with the driver's own words where it does not compile or link.
  GlProgram(const char* vertex_source, const char* fragment_source);
  GlProgram(const GlProgram&) = delete;
  GlProgram& operator=(const GlProgram&) = delete;
  ~GlProgram() { glDeleteProgram(program_); }

  void use() const { glUseProgram(program_); }
  [[nodiscard]] GLint uniform(const char* name) const { return glGetUniformLocation(program_, name); }

 private:
  GLuint program_ = 0;
};

/// A vertex shader for the four corners of the viewport, as a strip of triangles without any buffer. `at` runs to the
/// right and downwards, as a picture's rows do.
inline constexpr const char* kFourCorners = R"(#version 330 core
out vec2 at;
void main() {
  at = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = vec4(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, 0.0, 1.0);
}
)";

/// A mesh's triangles and edges; attributes 0 position, 1 normal, 2 material.
class GlMesh {
 public:
  explicit GlMesh(const Mesh& mesh);
  GlMesh(GlMesh&& other) noexcept { swap(other); }
  GlMesh& operator=(GlMesh&& other) noexcept {
    swap(other);
    return *this;
  }
  GlMesh(const GlMesh&) = delete;
  GlMesh& operator=(const GlMesh&) = delete;
  ~GlMesh();

  void draw_triangles() const;
  void draw_edges() const { draw_lines(edge_indices_); }
  /// Edges and what may be a silhouette.
  void draw_wires() const { draw_lines(edge_indices_ + round_indices_); }

 private:
  void swap(GlMesh& other) noexcept;
  void draw_lines(GLsizei indices) const;
  GLuint array_ = 0, vertices_ = 0, indices_ = 0;
  GLsizei triangle_indices_ = 0, edge_indices_ = 0, round_indices_ = 0;
};

/// Of the framebuffer that is bound: red, green, blue; rows from below.
[[nodiscard]] std::vector<std::uint8_t> bound_pixels(int width_px, int height_px);

// An OpenGL context without any window, and a picture in memory to draw into.

/// Mesa's surfaceless platform: needs no display. Current in the thread that makes it, which also ends it.
class Offscreen {
 public:
  /// @throws InputError where the driver gives no OpenGL 3.3 without a display.
  Offscreen(int width_px, int height_px);
  Offscreen(const Offscreen&) = delete;
  Offscreen& operator=(const Offscreen&) = delete;
  ~Offscreen();

  [[nodiscard]] std::vector<std::uint8_t> pixels() const { return bound_pixels(width_, height_); }
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
