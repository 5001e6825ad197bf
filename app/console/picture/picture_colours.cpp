#include "app/console/picture/picture_colours.h"

#include <cstdint>

#include "app/console/widgets/theme.h"

namespace knuckle::console::picture {
namespace {

/// 0xRRGGBB
Rgb rgb(std::uint32_t code) {
  return Rgb(static_cast<float>(code >> 16 & 0xFF), static_cast<float>(code >> 8 & 0xFF),
             static_cast<float>(code & 0xFF)) /
         255.0F;
}

Rgb rgb_of(ImU32 colour) {
  const ImVec4 c = ImGui::ColorConvertU32ToFloat4(colour);
  return {c.x, c.y, c.z};
}

/// What has a meaning has the same colour on the whole screen.
void set_meanings(PictureColours& c, const Palette& palette) {
  c.commanded = c.virtual_wall = rgb_of(palette.series[0]);
  c.hand = rgb_of(palette.series[2]);
  c.beside = rgb_of(palette.series[3]);
  c.force = rgb_of(palette.force);
}

}  // namespace

PictureColours light_picture_colours() {
  PictureColours c;
  c.material = {rgb(0xE3A93B), rgb(0x5A6068), rgb(0x8D949C), rgb(0xD5DADF), rgb(0x9DB6C6),
                rgb(0x474B50), rgb(0x6C727A), rgb(0xDDDCD6), rgb(0xB9B6AE), rgb(0xC9B9A6),
                rgb(0xA79C8E), rgb(0x7E9AA8), rgb(0xB08E68), rgb(0xD55E00)};
  c.background = rgb(0xEDF0F3);
  c.edge = rgb(0x2B2F34);
  c.grid = rgb(0xBDBBB3);
  c.shadow = rgb(0x2E3238);
  c.sky = {0.78F, 0.79F, 0.80F};
  c.earth = {0.56F, 0.55F, 0.53F};
  c.sun = {0.34F, 0.33F, 0.31F};
  c.uncertain = rgb(0x8A8F96);
  c.stale = rgb(0xB4B7BB);
  c.dust = rgb(0xBFB5A6);
  c.target_balls = {rgb(0xE000C0), rgb(0x00C030)};
  set_meanings(c, light_palette());
  return c;
}

PictureColours dark_picture_colours() {
  PictureColours c;
  c.material = {rgb(0xD79F38), rgb(0x596069), rgb(0x868D96), rgb(0xC3C9CF), rgb(0x6F8797),
                rgb(0x3A3E44), rgb(0x767D86), rgb(0x353A40), rgb(0x6B6A66), rgb(0x857868),
                rgb(0x7C7368), rgb(0x6E8C9B), rgb(0x7A6248), rgb(0xE8743B)};
  c.background = rgb(0x14171B);
  c.edge = rgb(0x0B0D0F);
  c.grid = rgb(0x4A5058);
  c.shadow = rgb(0x08090A);
  c.sky = {0.74F, 0.76F, 0.80F};
  c.earth = {0.46F, 0.46F, 0.47F};
  c.sun = {0.42F, 0.41F, 0.38F};
  c.uncertain = rgb(0x8A9099);
  c.stale = rgb(0x5E646B);
  c.dust = rgb(0x8A8174);
  c.target_balls = {rgb(0xE000C0), rgb(0x00C030)};
  set_meanings(c, dark_palette());
  return c;
}

}  // namespace knuckle::console::picture
