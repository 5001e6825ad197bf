// Shapes that mark something in the picture, one metre large: they are scaled to what they say.
#pragma once

#include "app/console/picture/mesh.h"

namespace knuckle::console::picture {

/// Of radius 1, in the arm's plane.
[[nodiscard]] Mesh disc_mesh();
/// Lines a metre apart in the arm's plane, to all sides of the origin.
[[nodiscard]] Mesh grid_mesh();
// Of an arrow along x.
[[nodiscard]] Mesh arrow_shaft();
[[nodiscard]] Mesh arrow_head();

}  // namespace knuckle::console::picture
