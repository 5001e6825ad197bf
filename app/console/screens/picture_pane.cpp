#include "app/console/screens/picture_pane.h"

namespace knuckle::console::screens {
namespace {

// In pixels of the design.
constexpr float kSide = 208;                  // what is beside the machine's picture
constexpr float kTitle = 34, kSwitches = 92;  // at the top of it: the title's part, and all with both switches
constexpr float kGrade = 104;                 // more, for the grade line's settings
constexpr float kDistances = 104;             // five lines
constexpr float kLegend = 30, kPad = 44, kGap = 6;
constexpr float kFiguresRight = 34, kFiguresBelow = 18;

}  // namespace

widgets::Area fitted(const widgets::Area& into, double aspect) {
  const auto a = static_cast<float>(aspect);
  const float width = std::min(into.width(), into.height() * a), x = into.centre().x;
  return {{x - width / 2, into.min.y}, {x + width / 2, into.min.y + width / a}};
}

PicturePane divide(const widgets::Theme& theme, widgets::Area pane, const PaneContents& has) {
  const widgets::Theme& t = theme;
  const float gap = t.px(kGap), switches = t.px(kSwitches + (has.grade ? kGrade : 0));
  PicturePane parts;
  parts.legend = pane.cut_bottom(t.px(kLegend));
  if (has.pad) parts.pad = pane.cut_bottom(t.px(kPad), gap);
  if (has.camera_aspect && has.camera_large) {
    widgets::Area above = pane;
    above.cut_bottom(std::max(switches - t.px(kTitle), t.px(kDistances)), gap);
    parts.camera = fitted(above, *has.camera_aspect);
    widgets::Area below{{pane.min.x, parts.camera->max.y + gap}, pane.max};
    parts.machine = below.cut_right(t.px(186), gap);
    parts.tools = below.cut_right(t.px(kSide - 8));
    parts.tools.min.y -= t.px(kTitle);  // the camera's title is in its picture
    parts.distances = below;
    return parts;
  }
  widgets::Area side = pane.cut_right(t.px(kSide));
  parts.tools = side.cut_top(switches);
  if (has.camera_aspect) {
    const float room = side.height() - t.px(kDistances) - gap;
    const float height = std::min(room, side.width() / static_cast<float>(*has.camera_aspect));
    parts.camera = fitted(side.cut_bottom(height, gap), *has.camera_aspect);
  }
  parts.distances = side;
  if (has.figures) {
    pane.cut_right(t.px(kFiguresRight));
    pane.cut_bottom(t.px(kFiguresBelow));
  }
  parts.machine = pane;
  return parts;
}

}  // namespace knuckle::console::screens
