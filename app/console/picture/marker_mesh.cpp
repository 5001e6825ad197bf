#include "app/console/picture/marker_mesh.h"

namespace knuckle::console::picture {

Mesh disc_mesh() {
  Mesh mesh;
  mesh.cone({0, 0.004, 0}, {0, -0.004, 0}, 1, 1, Material::kMarker, 40);
  return mesh;
}

Mesh grid_mesh() {
  constexpr int kGridLines = 48;  // to each side of the middle
  Mesh mesh;
  for (int i = -kGridLines; i <= kGridLines; ++i) {
    mesh.line({double(i), 0, -kGridLines}, {double(i), 0, kGridLines}, Material::kMarker);
    mesh.line({-kGridLines, 0, double(i)}, {kGridLines, 0, double(i)}, Material::kMarker);
  }
  return mesh;
}

Mesh arrow_shaft() {
  Mesh mesh;
  mesh.tube({0, 0, 0}, {1, 0, 0}, 1, Material::kMarker);
  return mesh;
}

Mesh arrow_head() {
  Mesh mesh;
  mesh.cone({0, 0, 0}, {1, 0, 0}, 1, 0, Material::kMarker);
  return mesh;
}

}  // namespace knuckle::console::picture
