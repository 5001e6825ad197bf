#include "app/console/picture/gl_program.h"

#include <algorithm>
#include <cstddef>
#include <string>

#include "core/error.h"

namespace knuckle::console::picture {
namespace {

static_assert(sizeof(MeshVertex) == 7 * sizeof(float), "the attributes below count on it");

GLuint compiled(GLenum kind, const char* source) {
  const GLuint shader = glCreateShader(kind);
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  GLint done = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &done);
  if (done != 0) return shader;
  std::string log(500, '\0');
  GLsizei length = 0;
  glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), &length, log.data());
  glDeleteShader(shader);
  throw InputError("OpenGL does not compile a shader: " + log.substr(0, log.find('\n')));
}

const void* offset(std::size_t bytes) {
  return reinterpret_cast<const void*>(bytes);
}

}  // namespace

GlProgram::GlProgram(const char* vertex_source, const char* fragment_source) : program_(glCreateProgram()) {
  const GLuint vertex = compiled(GL_VERTEX_SHADER, vertex_source);
  const GLuint fragment = compiled(GL_FRAGMENT_SHADER, fragment_source);
  for (const GLuint shader : {vertex, fragment}) {
    glAttachShader(program_, shader);
    glDeleteShader(shader);  // goes with the program
  }
  glLinkProgram(program_);
  GLint done = 0;
  glGetProgramiv(program_, GL_LINK_STATUS, &done);
  if (done == 0) throw InputError("OpenGL does not link a shader program");
}

GlMesh::GlMesh(const Mesh& mesh)
    : triangle_indices_(static_cast<GLsizei>(mesh.triangles.size())),
      edge_indices_(static_cast<GLsizei>(mesh.edges.size())),
      round_indices_(static_cast<GLsizei>(mesh.rounds.size())) {
  glGenVertexArrays(1, &array_);
  glGenBuffers(1, &vertices_);
  glGenBuffers(1, &indices_);
  glBindVertexArray(array_);
  glBindBuffer(GL_ARRAY_BUFFER, vertices_);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.vertices.size() * sizeof(MeshVertex)),
               mesh.vertices.data(), GL_STATIC_DRAW);
  std::vector<std::uint32_t> indices = mesh.triangles;
  indices.insert(indices.end(), mesh.edges.begin(), mesh.edges.end());
  indices.insert(indices.end(), mesh.rounds.begin(), mesh.rounds.end());
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size() * sizeof(std::uint32_t)), indices.data(),
               GL_STATIC_DRAW);
  const auto attribute = [](GLuint index, GLint floats, std::size_t at) {
    glEnableVertexAttribArray(index);
    glVertexAttribPointer(index, floats, GL_FLOAT, GL_FALSE, sizeof(MeshVertex), offset(at));
  };
  attribute(0, 3, offsetof(MeshVertex, position_m));
  attribute(1, 3, offsetof(MeshVertex, normal));
  attribute(2, 1, offsetof(MeshVertex, material));
  glBindVertexArray(0);
}

GlMesh::~GlMesh() {
  glDeleteVertexArrays(1, &array_);
  glDeleteBuffers(1, &vertices_);
  glDeleteBuffers(1, &indices_);
}

void GlMesh::swap(GlMesh& other) noexcept {
  std::swap(array_, other.array_);
  std::swap(vertices_, other.vertices_);
  std::swap(indices_, other.indices_);
  std::swap(triangle_indices_, other.triangle_indices_);
  std::swap(edge_indices_, other.edge_indices_);
  std::swap(round_indices_, other.round_indices_);
}

void GlMesh::draw_triangles() const {
  if (triangle_indices_ == 0) return;
  glBindVertexArray(array_);
  glDrawElements(GL_TRIANGLES, triangle_indices_, GL_UNSIGNED_INT, nullptr);
}

void GlMesh::draw_lines(GLsizei indices) const {
  if (indices == 0) return;
  glBindVertexArray(array_);
  glDrawElements(GL_LINES, indices, GL_UNSIGNED_INT,
                 offset(static_cast<std::size_t>(triangle_indices_) * sizeof(std::uint32_t)));
}

std::vector<std::uint8_t> bound_pixels(int width_px, int height_px) {
  std::vector<std::uint8_t> all(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) * 3);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width_px, height_px, GL_RGB, GL_UNSIGNED_BYTE, all.data());
  return all;
}

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
