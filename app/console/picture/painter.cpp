#include "app/console/picture/painter.h"

#include <cmath>
#include <numbers>

#include "app/console/picture/machine_mesh.h"

namespace knuckle::console::picture {
namespace {

// Colours are worked out at the corners: the processor may have to do all of this.
constexpr const char* kVertexSource = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in float material;
uniform mat4 transform;
uniform mat3 turn;
uniform vec3 palette[14];
uniform vec4 tint, kept;
uniform float alpha, lit;
uniform vec3 sky, earth, sun, sun_direction;
out vec4 colour;
void main() {
  gl_Position = transform * vec4(position, 1.0);
  gl_ClipDistance[0] = dot(kept, vec4(position, 1.0));
  vec3 n = normalize(turn * normal);
  vec3 light = mix(earth, sky, 0.5 + 0.5 * n.z) + sun * max(dot(n, sun_direction), 0.0);
  vec3 own = mix(palette[int(material + 0.5)], tint.rgb, tint.a);
  colour = vec4(own * mix(vec3(1.0), light, lit), alpha);
}
)";
constexpr const char* kFragmentSource = R"(#version 330 core
in vec4 colour;
out vec4 pixel;
void main() { pixel = colour; }
)";
static_assert(kMaterials == 14, "as in the shader");

}  // namespace

Eigen::Matrix4f in_space(const Frame2& frame) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  const Eigen::Matrix2d turn = frame.linear();
  m(0, 0) = turn(0, 0);
  m(0, 2) = turn(0, 1);
  m(2, 0) = turn(1, 0);
  m(2, 2) = turn(1, 1);
  m(0, 3) = frame.translation().x();
  m(2, 3) = frame.translation().y();
  return m.cast<float>();
}

Eigen::Matrix4f scaled(const Eigen::Matrix4f& frame, double x, double y, double z) {
  Eigen::Matrix4f m = frame;
  m.col(0) *= static_cast<float>(x);
  m.col(1) *= static_cast<float>(y);
  m.col(2) *= static_cast<float>(z);
  return m;
}

Eigen::Vector3f sun_direction() {
  return Eigen::Vector3f(0.30F, -0.45F, 0.84F).normalized();
}

Painter::Painter() : program_(kVertexSource, kFragmentSource) {}

void Painter::begin(const Eigen::Matrix4f& view_projection, const PictureColours& colours) {
  view_projection_ = view_projection;
  program_.use();
  glUniform3fv(program_.uniform("palette"), kMaterials, colours.material.front().data());
  glUniform3fv(program_.uniform("sky"), 1, colours.sky.data());
  glUniform3fv(program_.uniform("earth"), 1, colours.earth.data());
  glUniform3fv(program_.uniform("sun"), 1, colours.sun.data());
  glUniform3fv(program_.uniform("sun_direction"), 1, sun_direction().data());
}

void Painter::set(const Eigen::Matrix4f& model, const Look& look) {
  const Eigen::Matrix4f transform = view_projection_ * model;
  const Eigen::Matrix3f turn = model.topLeftCorner<3, 3>();
  glUniformMatrix4fv(program_.uniform("transform"), 1, GL_FALSE, transform.data());
  glUniformMatrix3fv(program_.uniform("turn"), 1, GL_FALSE, turn.data());
  glUniform4f(program_.uniform("tint"), look.tint.x(), look.tint.y(), look.tint.z(), look.tinted);
  glUniform1f(program_.uniform("alpha"), look.alpha);
  glUniform4fv(program_.uniform("kept"), 1, look.kept.data());
  glUniform1f(program_.uniform("lit"), look.lit ? 1.0F : 0.0F);
}

void Painter::triangles(const GlMesh& mesh, const Eigen::Matrix4f& model, const Look& look) {
  set(model, look);
  mesh.draw_triangles();
}

void Painter::edges(const GlMesh& mesh, const Eigen::Matrix4f& model, const Look& look) {
  set(model, look);
  mesh.draw_edges();
}

void Painter::wires(const GlMesh& mesh, const Eigen::Matrix4f& model, const Look& look) {
  set(model, look);
  mesh.draw_wires();
}

namespace {

using Eigen::Matrix4f;

/// Of radius 1, in slices.
Mesh ball_mesh() {
  constexpr int kSlices = 8;
  Mesh mesh;
  for (int i = 0; i < kSlices; ++i) {
    const auto at = [](int slice) { return std::numbers::pi * slice / kSlices; };
    mesh.cone({0, 0, -std::cos(at(i))}, {0, 0, -std::cos(at(i + 1))}, std::sin(at(i)), std::sin(at(i + 1)),
              Material::kMarker);
  }
  return mesh;
}

/// Of radius 1, upright to z.
Mesh puff_mesh() {
  Mesh mesh;
  mesh.cone({0, 0, -1e-3}, {0, 0, 1e-3}, 1, 1, Material::kMarker, 16);
  return mesh;
}

}  // namespace

SeenThings::SeenThings() : ball_(ball_mesh()), puff_(puff_mesh()) {}

void SeenThings::draw_balls(Painter& painter, const Matrix4f& bucket, const MachineDescription& machine,
                            const PictureColours& colours) const {
  const TargetBalls balls = target_balls(machine);
  for (std::size_t i = 0; i < balls.at_m.size(); ++i) {
    Matrix4f place = Matrix4f::Identity();
    place.topRightCorner<3, 1>() = balls.at_m[i].cast<float>();
    place = bucket * place;
    painter.triangles(ball_, scaled(place, balls.radius_m, balls.radius_m, balls.radius_m),
                      {colours.target_balls[i], 1, 1, false});
  }
}

/// Discs in discs, all turned to the camera: thick in the middle, thin at the rim.
void SeenThings::draw_dust(Painter& painter, const std::vector<Puff>& puffs, const Camera& camera,
                           const Rgb& colour) const {
  for (const Puff& one : puffs) {
    Matrix4f place = Matrix4f::Identity();
    place.topLeftCorner<3, 3>() = facing(camera).cast<float>();
    place.topRightCorner<3, 1>() = one.at_m.cast<float>();
    for (const double share : {1.0, 0.7, 0.4}) {
      const double radius = share * one.radius_m;
      painter.triangles(puff_, scaled(place, radius, radius, radius), {colour, 1, one.alpha, false});
    }
  }
}

}  // namespace knuckle::console::picture
