// Colours of the machine's picture, light and dark: blue, green and vermilion of Okabe and Ito for what is commanded,
// requested and felt, which people with any colour vision tell apart; the machine itself and the world stay muted.
#pragma once

#include <Eigen/Core>
#include <array>

#include "app/console/picture/mesh.h"

namespace knuckle::console::picture {

using Rgb = Eigen::Vector3f;  ///< sRGB, [0, 1].

struct PictureColours {
  std::array<Rgb, kMaterials> material;
  Rgb background;
  Rgb edge, grid, shadow;
  Rgb sky, earth, sun;  ///< Light from above, from below and along one direction; factors on a material's colour.
  Rgb dust;
  std::array<Rgb, 2> target_balls;  ///< Of nothing else in the picture: programs look for them.
  Rgb commanded, hand, beside, force, uncertain, virtual_wall, stale;
};

[[nodiscard]] PictureColours light_picture_colours();
[[nodiscard]] PictureColours dark_picture_colours();

}  // namespace knuckle::console::picture
