#include "app/console/screens/measures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/console/machine_text.h"
#include "app/console/screens/console_data.h"

namespace knuckle::console::screens {
namespace {

constexpr double kSteepest = 2;    // 200 %
constexpr double kHighest_m = 50;  // what is typed beyond is a slip

struct Field {
  const char *label, *id, *format, *unit;
  double shown_per_unit;  ///< What is typed, by what is kept.
  double most;            ///< Kept, either side of zero.
};

/// @return whether what is typed has changed the value.
bool number_row(const Ui& ui, Area row, const Field& field, double& value, Measures& measures) {
  const Theme& t = ui.theme;
  put_label(t, row, field.label);
  row.cut_left(t.px(52));
  const Area unit = row.cut_right(t.px(20), t.px(4));
  put_label(t, unit, field.unit);
  double shown = value * field.shown_per_unit;
  ImGui::SetCursorScreenPos(row.min);
  ImGui::SetNextItemWidth(row.width());
  ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, {t.px(6), (row.height() - ImGui::GetFontSize()) / 2});
  const bool typed = ImGui::InputDouble(field.id, &shown, 0, 0, field.format, ImGuiInputTextFlags_CharsDecimal);
  ui.focus.add_last_item();
  ImGui::PopStyleVar();
  measures.typed |= ImGui::IsItemActive();
  if (!typed || !std::isfinite(shown)) return false;
  const double wanted = shown / field.shown_per_unit;
  value = std::clamp(wanted, -field.most, field.most);
  measures.say(value == wanted ? ""
                               : fmt::format("{} {:g} {} is beyond {:.0f}: limited", field.label, shown, field.unit,
                                             field.most * field.shown_per_unit));
  return true;
}

}  // namespace

void Measures::take_tip(const PlanarVector& tip_m) {
  constexpr double kLeastRun_m = 0.02;
  const PlanarVector run = tip_m - grade.point_m;
  switch (std::exchange(take, Take::kNothing)) {
    case Take::kNothing:
      return;
    case Take::kGround:
      ground_m = tip_m.y();
      return say("");
    case Take::kGradePoint:
      grade.point_m = tip_m;
      grade_on = has_point = true;
      return say("");
    case Take::kGradeSlope:
      if (!has_point) return say("slope: take a point of the line first (T)");
      if (std::abs(run.x()) < kLeastRun_m)
        return say(fmt::format("slope: the tip is {:.0f} mm from the point, needs {:.0f} mm", 1e3 * std::abs(run.x()),
                               1e3 * kLeastRun_m));
      grade.slope = std::clamp(run.y() / run.x(), -kSteepest, kSteepest);
      grade_on = true;
      return say(
          std::abs(run.y()) <= kSteepest * std::abs(run.x())
              ? ""
              : fmt::format("slope {:.0f} % is beyond {:.0f} %: limited", 100 * run.y() / run.x(), 100 * kSteepest));
  }
}

void Measures::drop() {
  if (std::exchange(take, Take::kNothing) != Take::kNothing) say("not taken: the place of the tip is not known now");
}

void Measures::say(const std::string& line) {
  said = line;
  said_s = -1;
}

void draw_said(const Ui& ui, Measures& measures, Area& area) {
  constexpr double kShown_s = 8;
  if (measures.said_s < 0) measures.said_s = ui.now_s;
  if (measures.said.empty() || ui.now_s - measures.said_s > kShown_s) return;
  const Theme& t = ui.theme;
  area.cut_top(put_lines(t.fonts.small, t.colours.notice, area, ui.units.as_shown(measures.said)), t.px(4));
}

void draw_grade_panel(const Ui& ui, Measures& measures, const Area& tools) {
  const Theme& t = ui.theme;
  Area rest = tools.inset(t.unit(1.5F), t.unit());
  rest.cut_top(t.px(58));
  rest.min.x = std::max(rest.min.x, rest.max.x - t.px(186));
  toggle(ui, rest.cut_top(t.px(26), t.px(4)), "Grade line", measures.grade_on);
  if (!measures.grade_on) return;
  const double per_m = ui.units.convert(Quantity::kLength, 1);
  double height_m = measures.grade.point_m.y() - measures.zero_m();
  if (number_row(ui, rest.cut_top(t.px(26), t.px(4)),
                 {"height", "##height", "%.2f", ui.units.unit(Quantity::kLength), per_m, kHighest_m}, height_m,
                 measures))
    measures.grade.point_m.y() = measures.zero_m() + height_m;
  (void)number_row(ui, rest.cut_top(t.px(26), t.px(4)), {"slope", "##slope", "%.1f", "%", 100, kSteepest},
                   measures.grade.slope, measures);
  const Area buttons = rest.cut_top(t.px(28));
  if (button(ui, buttons.column(0, 2, t.px(4)), Icon::kNone, "to tip (T)")) measures.take = Measures::Take::kGradePoint;
  if (button(ui, buttons.column(1, 2, t.px(4)), Icon::kNone, "slope (Y)", false, measures.has_point))
    measures.take = Measures::Take::kGradeSlope;
}

std::optional<ContactTrail::Touch> ContactTrail::watch(const ConsoleView& view, const Kinematics& kinematics,
                                                       double reach_m) {
  const bool touches = force_text(view).contact;
  const bool begins = touches && !touched_;
  touched_ = touches;
  if (!touches) return std::nullopt;
  const PlanarVector tip_m = kinematics.tip(view.machine.position_rad);
  const Point& newest = points_[(next_ + kMost - 1) % kMost];
  const Touch touch{view.now, tip_m, begins || (tip_m - newest.at_m).norm() >= kApart * reach_m};
  add(touch);
  return touch;
}

void ContactTrail::add(const Touch& touch) {
  tip_m_ = touch.tip_m;
  if (!touch.apart) return;
  points_[next_] = {touch.tip_m, touch.at};
  next_ = (next_ + 1) % kMost;
}

double ContactTrail::freshness(const Point& point, Time now) noexcept {
  if (point.at == kNever || point.at > now) return 0;
  return std::max(0.0, 1 - to_seconds(now - point.at) / to_seconds(kKept));
}

std::vector<Distance> distances(const PlanarVector& tip_m, const Measures& by, const LimitsDescription& limits,
                                const ContactTrail& last) {
  constexpr double kFar_m = 1e3;  // a wall that the machine file does not set
  std::vector<Distance> all{{by.ground_m ? "above chosen ground" : "above the boom's pin", tip_m.y() - by.zero_m()},
                            {"reach", tip_m.x()}};
  if (by.grade_on) all.push_back({"over the grade line", tip_m.y() - by.grade.height_m(tip_m.x()), true});
  const auto walls = std::to_array<Distance>({{"to the floor", tip_m.y() - limits.floor_m},
                                              {"to the ceiling", limits.ceiling_m - tip_m.y()},
                                              {"to the reach limit", limits.reach_m - tip_m.x()}});
  const auto nearest =
      std::min_element(walls.begin(), walls.end(), [](const Distance& a, const Distance& b) { return a.m < b.m; });
  if (nearest->m < kFar_m) all.push_back(*nearest);
  if (last.tip_m()) all.push_back({"to the last contact", (tip_m - *last.tip_m()).norm()});
  return all;
}

void draw_distances(const Ui& ui, const ConsoleData& data, const Measures& measures, const Area& area) {
  if (measured_freshness(data.view).after(ui.view_age_s).stale()) return;
  const Theme& t = ui.theme;
  const PlanarVector tip_m = data.kinematics.tip(data.view.machine.position_rad);
  const float number = area.min.x + t.px(70), label = number + t.unit();
  float y = area.min.y + t.px(12);
  for (const Distance& d : distances(tip_m, measures, data.facts.machine.limits, data.kept.contacts)) {
    put_text(t.fonts.mono_small, t.colours.text, {number, y}, Align::kRight,
             fmt::format("{}{}", d.has_sign && d.m >= 0 ? "+" : "", ui.units.text(Quantity::kLength, d.m)));
    put_fitted(t.fonts.small, t.colours.muted, {{label, y - t.px(9)}, {area.max.x, y + t.px(9)}}, d.label);
    y += t.px(20);
  }
}

}  // namespace knuckle::console::screens
