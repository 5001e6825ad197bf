#include "app/console/picture/seen_things.h"

#include <cmath>
#include <numbers>

#include "app/console/picture/machine_mesh.h"

namespace knuckle::console::picture {
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
