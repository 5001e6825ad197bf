#include "app/console/screens/picture_pane.h"

#include <cmath>
#include <vector>

#include "app/console/picture/machine_mesh.h"
#include "app/console/picture/machine_panel.h"
#include "app/console/screens/measures.h"
#include "machine/kinematics.h"

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

Area fitted(const Area& into, double aspect) {
  const auto a = static_cast<float>(aspect);
  const float width = std::min(into.width(), into.height() * a), x = into.centre().x;
  return {{x - width / 2, into.min.y}, {x + width / 2, into.min.y + width / a}};
}

PicturePane divide(const Theme& theme, Area pane, const PaneContents& has) {
  const Theme& t = theme;
  const float gap = t.px(kGap), switches = t.px(kSwitches + (has.grade ? kGrade : 0));
  PicturePane parts;
  parts.legend = pane.cut_bottom(t.px(kLegend));
  if (has.pad) parts.pad = pane.cut_bottom(t.px(kPad), gap);
  if (has.camera_aspect && has.camera_large) {
    Area above = pane;
    above.cut_bottom(std::max(switches - t.px(kTitle), t.px(kDistances)), gap);
    parts.camera = fitted(above, *has.camera_aspect);
    Area below{{pane.min.x, parts.camera->max.y + gap}, pane.max};
    parts.machine = below.cut_right(t.px(186), gap);
    parts.tools = below.cut_right(t.px(kSide - 8));
    parts.tools.min.y -= t.px(kTitle);  // the camera's title is in its picture
    parts.distances = below;
    return parts;
  }
  Area side = pane.cut_right(t.px(kSide));
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

namespace {

constexpr ImU32 with_alpha(ImU32 colour, double share) {
  return (colour & ~IM_COL32_A_MASK) | static_cast<ImU32>(share * 255) << IM_COL32_A_SHIFT;
}

/// Points of the arm's plane on the screen.
class Plane {
 public:
  Plane(const picture::Camera& camera, const Area& area) : camera_(camera), area_(area) {}
  [[nodiscard]] std::optional<ImVec2> at(const PlanarVector& point_m) const {
    const auto pixel = picture::pixel_of(camera_, picture::viewport_of(area_), {point_m.x(), 0, point_m.y()});
    if (!pixel) return std::nullopt;
    const ImVec2 s = ImGui::GetIO().DisplayFramebufferScale;
    return ImVec2{area_.min.x + static_cast<float>(pixel->x()) / s.x,
                  area_.min.y + static_cast<float>(pixel->y()) / s.y};
  }
  /// Frame M, of a side view.
  [[nodiscard]] std::pair<double, double> seen_x_m() const {
    const picture::Viewport port = picture::viewport_of(area_);
    const auto left = picture::plane_point(camera_, port, {0, 0});
    const auto right = picture::plane_point(camera_, port, {port.width_px, 0});
    return {left->x(), right->x()};
  }

 private:
  const picture::Camera& camera_;
  const Area& area_;
};

/// Heights right of the picture, forward distances below it.
void grid_figures(const Ui& ui, const picture::Grid& grid, const Measures& measures, const Plane& plane,
                  const Area& area) {
  const Theme& t = ui.theme;
  const double unit = ui.units.convert(Quantity::kLength, 1);
  const int digits = std::max(0, static_cast<int>(std::ceil(-std::log10(grid.step_m * unit) - 1e-9)));
  constexpr int kMost = 48;
  const float right = area.max.x + t.px(32), below = area.max.y + t.px(9), margin = t.px(12);
  const auto figure = [&](double value_m, ImVec2 at, Align align) {
    const double value = value_m * unit;
    const std::string text = fixed(std::abs(value) < 1e-9 ? 0 : value, digits);
    put_text(t.fonts.small, t.colours.muted, at, align, text);
  };
  for (int i = -kMost; i <= kMost; ++i) {
    const PlanarVector p = grid.middle_m + PlanarVector::Constant(i * grid.step_m);
    const auto at = plane.at(p);
    if (!at) continue;
    if (at->y > area.min.y + margin && at->y < area.max.y - margin)
      figure(p.y() - measures.zero_m(), {right, at->y}, Align::kRight);
    if (at->x > area.min.x + margin && at->x < area.max.x - margin) figure(p.x(), {at->x, below}, Align::kCentre);
  }
  put_text(t.fonts.small, t.colours.muted, {right, below}, Align::kRight, ui.units.unit(Quantity::kLength));
}

/// At the picture's edge, where the bucket's tip is beyond it.
void bucket_arrow(const Ui& ui, const ConsoleData& data, const Plane& plane, const Area& picture) {
  const Theme& t = ui.theme;
  const auto tip = plane.at(data.kinematics.tip(data.view.machine.position_rad));
  if (!tip) return;
  if (tip->x >= picture.min.x && tip->x <= picture.max.x && tip->y >= picture.min.y && tip->y <= picture.max.y) return;
  const Area edge = picture.inset(t.px(14));
  const ImVec2 middle = edge.centre(), d{tip->x - middle.x, tip->y - middle.y};
  const float reach =
      std::min(edge.width() / 2 / std::max(std::abs(d.x), 1e-3F), edge.height() / 2 / std::max(std::abs(d.y), 1e-3F));
  const ImVec2 at{middle.x + reach * d.x, middle.y + reach * d.y};
  const float length = std::hypot(d.x, d.y), size = t.px(12);
  const ImVec2 u{d.x / length * size, d.y / length * size}, n{-u.y, u.x};
  canvas().AddTriangleFilled({at.x + u.x, at.y + u.y}, {at.x - u.x + n.x, at.y - u.y + n.y},
                             {at.x - u.x - n.x, at.y - u.y - n.y}, t.colours.notice);
  const float half = text_width(t.fonts.small, "bucket") / 2;
  const ImVec2 below{std::clamp(at.x - 2.5F * u.x, edge.min.x + half, edge.max.x - half), at.y - 2.5F * u.y};
  put_text(t.fonts.small, t.colours.notice, below, Align::kCentre, "bucket");
}

/// Across the whole picture; dashed where it only says a height.
void long_line(const Plane& plane, const GradeLine& line, ImU32 colour, float width, bool dashed) {
  const auto [left_m, right_m] = plane.seen_x_m();
  const auto from = plane.at({left_m, line.height_m(left_m)}), to = plane.at({right_m, line.height_m(right_m)});
  if (!from || !to) return;
  if (!dashed) return canvas().AddLine(*from, *to, colour, width);
  const float length = std::hypot(to->x - from->x, to->y - from->y), dash = 6 * width;
  const ImVec2 d{(to->x - from->x) / length, (to->y - from->y) / length};
  for (float s = 0; s < length; s += 2 * dash)
    canvas().AddLine({from->x + s * d.x, from->y + s * d.y},
                     {from->x + std::min(length, s + dash) * d.x, from->y + std::min(length, s + dash) * d.y}, colour,
                     width);
}

void levels(const Ui& ui, const Measures& measures, const Plane& plane, const Area& area) {
  const Theme& t = ui.theme;
  if (measures.ground_m) {
    const GradeLine ground{{0, *measures.ground_m}, 0};
    long_line(plane, ground, t.colours.muted, t.px(1.5F), true);
    if (const auto at = plane.at({0, *measures.ground_m}))
      put_text(t.fonts.small, t.colours.muted, {area.min.x + t.px(12), at->y + t.px(11)}, Align::kLeft,
               "chosen ground");
  }
  if (!measures.grade_on) return;
  const ImU32 colour = t.colours.series[3];
  long_line(plane, measures.grade, colour, t.px(2), false);
  if (const auto at = plane.at(measures.grade.point_m)) canvas().AddCircleFilled(*at, t.px(4), colour);
}

void trail(const Ui& ui, const ConsoleData& data, const Plane& plane) {
  const Theme& t = ui.theme;
  for (const ContactTrail::Point& point : data.kept.contacts.points()) {
    const double fresh = ContactTrail::freshness(point, data.view.now);
    if (fresh <= 0) continue;
    if (const auto at = plane.at(point.at_m))
      canvas().AddCircleFilled(*at, t.px(3.5F), with_alpha(t.colours.force, 0.15 + 0.75 * fresh));
  }
}

/// As much of the bucket as the estimate is of a full one; nothing where it is not known.
std::vector<ImVec2> load_corners(const ConsoleData& data, const Plane& plane) {
  const SlaveMessage& m = data.view.machine;
  const MachineDescription& machine = data.facts.machine;
  const double full_kg = machine.payload_full_scale_kg;
  if (!payload_is_known(m, full_kg) || m.payload_kg < 2 * m.payload_sigma_kg) return {};
  const Frame2 bucket = pose_of(machine, m.position_rad).bucket;
  picture::Outline room = picture::bucket_room(machine);
  for (PlanarVector& corner : room) corner = bucket * corner;
  std::vector<ImVec2> points;
  for (const PlanarVector& corner : picture::filled(room, m.payload_kg / full_kg))
    if (const auto at = plane.at(corner)) points.push_back(*at);
  return points;
}

void load(const Ui& ui, const std::vector<ImVec2>& points) {
  if (points.size() < 3) return;
  const ImU32 colour = ui.theme.colours.series[1];
  const auto count = static_cast<int>(points.size());
  canvas().AddConvexPolyFilled(points.data(), count, with_alpha(colour, 0.85));
  canvas().AddPolyline(points.data(), count, colour, ImDrawFlags_Closed, ui.theme.px(1.5F));
}

/// A ring on the pin of each joint that is at its end. Banner and limits have the words, which would lie over the
/// machine.
void ends(const Ui& ui, const ConsoleData& data, const Plane& plane) {
  const Theme& t = ui.theme;
  const MachinePose pose = pose_of(data.facts.machine, data.view.machine.position_rad);
  const PerJoint<PlanarVector> pins_m{pose.boom.translation(), pose.arm.translation(), pose.bucket.translation()};
  for (std::size_t i = 0; i < kJoints; ++i) {
    if (data.loads[i].end == 0) continue;
    const auto at = plane.at(pins_m[i]);
    if (at) canvas().AddCircle(*at, t.px(9), t.colours.notice, 0, t.px(3));
  }
}

}  // namespace

std::optional<picture::Grid> shown_grid(const Units& units, const UiState& state, const picture::Camera& camera,
                                        const Area& picture) {
  if (camera.kind != picture::Camera::Kind::kSide) return std::nullopt;
  return picture::grid_of(camera, picture::viewport_of(picture), 1 / units.convert(Quantity::kLength, 1),
                          state.measures.zero_m());
}

void draw_marks(const Ui& ui, const ConsoleData& data, const UiState& state, const Area& picture, bool figures) {
  if (picture.width() < 1 || picture.height() < 1) return;
  const picture::Camera& camera = data.machine.camera(state.side_view);
  const Plane plane(camera, picture);
  const auto grid = shown_grid(ui.units, state, camera, picture);
  if (grid && figures) grid_figures(ui, *grid, state.measures, plane, picture);
  canvas().PushClipRect(picture.min, picture.max, true);
  if (grid) levels(ui, state.measures, plane, picture);
  if (!measured_freshness(data.view).after(ui.view_age_s).stale()) load(ui, load_corners(data, plane));
  trail(ui, data, plane);
  ends(ui, data, plane);
  if (measured_freshness(data.view).heard) bucket_arrow(ui, data, plane, picture);
  canvas().PopClipRect();
}

}  // namespace knuckle::console::screens
