#include <array>
#include <cmath>
#include <numbers>

#include "app/console/widgets/widgets.h"

namespace knuckle::console {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

/// Draws in a square from -1 to 1, y down.
struct Pen {
  ImDrawList& list;
  ImVec2 centre;
  float half;
  ImU32 colour;
  float width;

  [[nodiscard]] ImVec2 at(float x, float y) const { return {centre.x + x * half, centre.y + y * half}; }
  void line(float x1, float y1, float x2, float y2) const { list.AddLine(at(x1, y1), at(x2, y2), colour, width); }
  void disc(float x, float y, float r) const { list.AddCircleFilled(at(x, y), r * half, colour); }
  void circle(float x, float y, float r) const { list.AddCircle(at(x, y), r * half, colour, 0, width); }
  void box(float x1, float y1, float x2, float y2, float round) const {
    list.AddRect(at(x1, y1), at(x2, y2), colour, round * half, 0, width);
  }
  void block(float x1, float y1, float x2, float y2, float round = 0) const {
    list.AddRectFilled(at(x1, y1), at(x2, y2), colour, round * half);
  }
  void arc(float x, float y, float r, float from, float to) const {
    list.PathArcTo(at(x, y), r * half, from, to);
    list.PathStroke(colour, 0, width);
  }
  template <std::size_t N>
  void path(const std::array<ImVec2, N>& points, bool closed = false) const {
    for (const ImVec2& p : points) list.PathLineTo(at(p.x, p.y));
    list.PathStroke(colour, closed ? ImDrawFlags_Closed : 0, width);
  }
};

void warning(const Pen& p) {
  p.path(std::array{ImVec2{0, -0.85F}, ImVec2{0.95F, 0.8F}, ImVec2{-0.95F, 0.8F}}, true);
  p.line(0, -0.3F, 0, 0.25F);
  p.disc(0, 0.52F, 0.12F);
}

void link(const Pen& p) {
  for (const float side : {-1.F, 1.F}) {
    p.arc(side * 0.5F, -side * 0.0F, 0.38F, side < 0 ? 0.5F * kPi : -0.5F * kPi, side < 0 ? 1.5F * kPi : 0.5F * kPi);
    p.line(side * 0.5F, -0.38F, side * 0.12F, -0.38F);
    p.line(side * 0.5F, 0.38F, side * 0.12F, 0.38F);
  }
  p.line(-0.42F, 0, 0.42F, 0);
}

void drop(const Pen& p) {
  p.list.PathLineTo(p.at(0, -0.95F));
  p.list.PathBezierCubicCurveTo(p.at(0.3F, -0.5F), p.at(0.68F, -0.1F), p.at(0.68F, 0.28F));
  p.list.PathArcTo(p.at(0, 0.28F), 0.68F * p.half, 0.1F, kPi - 0.1F);
  p.list.PathBezierCubicCurveTo(p.at(-0.68F, -0.1F), p.at(-0.3F, -0.5F), p.at(-0.01F, -0.95F));
  p.list.PathStroke(p.colour, ImDrawFlags_Closed, p.width);
}

void wrench(const Pen& p) {
  p.arc(0.42F, -0.42F, 0.45F, -0.05F * kPi, 1.55F * kPi);
  p.line(0.42F, -0.42F, 0.86F, -0.5F);
  p.line(0.42F, -0.42F, 0.5F, -0.86F);
  p.line(0.1F, -0.1F, -0.8F, 0.8F);
}

void arm(const Pen& p) {
  p.path(std::array{ImVec2{-0.85F, 0.8F}, ImVec2{-0.35F, -0.6F}, ImVec2{0.55F, -0.15F}, ImVec2{0.55F, 0.35F}});
  p.path(std::array{ImVec2{0.85F, 0.35F}, ImVec2{0.3F, 0.35F}, ImVec2{0.2F, 0.8F}, ImVec2{0.7F, 0.8F}}, true);
  p.disc(-0.35F, -0.6F, 0.16F);
}

void hand(const Pen& p) {
  p.path(std::array{ImVec2{-0.6F, 0.1F}, ImVec2{-0.2F, 0.85F}, ImVec2{0.5F, 0.85F}, ImVec2{0.65F, -0.35F}});
  for (int i = 0; i < 4; ++i) {
    const float x = -0.25F + 0.3F * static_cast<float>(i);
    p.line(x, 0.15F, x, -0.85F + 0.12F * std::abs(static_cast<float>(i) - 1.5F));
  }
}

void gamepad(const Pen& p) {
  p.box(-0.95F, -0.45F, 0.95F, 0.55F, 0.5F);
  p.line(-0.65F, 0.05F, -0.25F, 0.05F);
  p.line(-0.45F, -0.15F, -0.45F, 0.25F);
  p.disc(0.35F, 0.2F, 0.13F);
  p.disc(0.6F, -0.08F, 0.13F);
}

void keyboard(const Pen& p) {
  p.box(-0.95F, -0.6F, 0.95F, 0.6F, 0.2F);
  for (const float y : {-0.25F, 0.05F})
    for (int i = 0; i < 4; ++i) p.disc(-0.57F + 0.38F * static_cast<float>(i), y, 0.1F);
  p.line(-0.4F, 0.34F, 0.4F, 0.34F);
}

void padlock(const Pen& p) {
  p.block(-0.65F, -0.05F, 0.65F, 0.85F, 0.15F);
  p.arc(0, -0.1F, 0.42F, kPi, 2 * kPi);
  p.line(-0.42F, -0.1F, -0.42F, 0);
  p.line(0.42F, -0.1F, 0.42F, 0);
}

/// @param side 1: to the right. Triangles, and a bar where they stop.
void step(const Pen& p, float side, int triangles) {
  const float wide = triangles > 1 ? 0.7F : 1.1F;
  for (int i = 0; i < triangles; ++i) {
    const float x = side * (-0.8F + wide * static_cast<float>(i));
    const ImVec2 a = p.at(x, -0.65F), b = p.at(x + side * wide, 0), c = p.at(x, 0.65F);
    if (side > 0)
      p.list.AddTriangleFilled(a, b, c, p.colour);
    else
      p.list.AddTriangleFilled(a, c, b, p.colour);
  }
  const float x = side * (-0.8F + wide * static_cast<float>(triangles));
  p.block(std::min(x, x + side * 0.18F), -0.65F, std::max(x, x + side * 0.18F), 0.65F);
}

void reset(const Pen& p) {
  p.arc(0, 0, 0.7F, -0.2F * kPi, 1.45F * kPi);
  p.list.AddTriangleFilled(p.at(0.05F, -1.0F), p.at(0.05F, -0.4F), p.at(-0.5F, -0.7F), p.colour);
}

}  // namespace

void draw_icon(ImDrawList& list, Icon icon, ImVec2 centre, float size, ImU32 colour) {
  const Pen p{list, centre, size / 2, colour, std::max(1.F, size * 0.09F)};
  switch (icon) {
    case Icon::kNone:
      return;
    case Icon::kStop:
      // Flat on top, as on the road.
      for (int i = 0; i < 8; ++i) {
        const float a = (static_cast<float>(i) + 0.5F) * kPi / 4;
        list.PathLineTo(p.at(std::cos(a), std::sin(a)));
      }
      return list.PathFillConvex(colour);
    case Icon::kLink:
      return link(p);
    case Icon::kClock:
      p.circle(0, 0, 0.88F);
      return p.path(std::array{ImVec2{0, -0.5F}, ImVec2{0, 0.05F}, ImVec2{0.38F, 0.28F}});
    case Icon::kDrop:
      return drop(p);
    case Icon::kWrench:
      return wrench(p);
    case Icon::kList:
      for (const float y : {-0.6F, 0.F, 0.6F}) {
        p.disc(-0.75F, y, 0.13F);
        p.line(-0.4F, y, 0.85F, y);
      }
      return;
    case Icon::kWarning:
      return warning(p);
    case Icon::kCheck:
      return p.path(std::array{ImVec2{-0.75F, 0.05F}, ImVec2{-0.2F, 0.6F}, ImVec2{0.8F, -0.6F}});
    case Icon::kLock:
      return padlock(p);
    case Icon::kPause:
      p.block(-0.55F, -0.7F, -0.15F, 0.7F);
      return p.block(0.15F, -0.7F, 0.55F, 0.7F);
    case Icon::kPlay:
      return list.AddTriangleFilled(p.at(-0.5F, -0.75F), p.at(0.75F, 0), p.at(-0.5F, 0.75F), colour);
    case Icon::kKeyboard:
      return keyboard(p);
    case Icon::kGamepad:
      return gamepad(p);
    case Icon::kArm:
      return arm(p);
    case Icon::kDot:
      return p.disc(0, 0, 0.6F);
    case Icon::kRing:
      return p.circle(0, 0, 0.6F);
    case Icon::kCircle:
      p.circle(0, 0, 0.85F);
      p.disc(0, -0.42F, 0.13F);
      return p.line(0, -0.1F, 0, 0.5F);
    case Icon::kHand:
      return hand(p);
    case Icon::kReset:
      return reset(p);
    case Icon::kStepBack:
      return step(p, -1, 1);
    case Icon::kStepOn:
      return step(p, 1, 1);
    case Icon::kEventBack:
      return step(p, -1, 2);
    case Icon::kEventOn:
      return step(p, 1, 2);
    case Icon::kPlot:
      p.path(std::array{ImVec2{-0.85F, -0.85F}, ImVec2{-0.85F, 0.85F}, ImVec2{0.85F, 0.85F}});
      return p.path(std::array{ImVec2{-0.55F, 0.45F}, ImVec2{-0.1F, -0.3F}, ImVec2{0.25F, 0.2F}, ImVec2{0.75F, -0.7F}});
  }
}

}  // namespace knuckle::console
