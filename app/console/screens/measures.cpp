#include "app/console/screens/measures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/console/widgets/widgets.h"

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
bool number_row(const widgets::Ui& ui, widgets::Area row, const Field& field, double& value, Measures& measures) {
  const widgets::Theme& t = ui.theme;
  widgets::put_label(t, row, field.label);
  row.cut_left(t.px(52));
  const widgets::Area unit = row.cut_right(t.px(20), t.px(4));
  widgets::put_label(t, unit, field.unit);
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

void draw_said(const widgets::Ui& ui, Measures& measures, widgets::Area& area) {
  constexpr double kShown_s = 8;
  if (measures.said_s < 0) measures.said_s = ui.now_s;
  if (measures.said.empty() || ui.now_s - measures.said_s > kShown_s) return;
  const widgets::Theme& t = ui.theme;
  area.cut_top(widgets::put_lines(t.fonts.small, t.colours.notice, area, ui.units.as_shown(measures.said).c_str()),
               t.px(4));
}

void draw_grade_panel(const widgets::Ui& ui, Measures& measures, const widgets::Area& tools) {
  const widgets::Theme& t = ui.theme;
  widgets::Area rest = tools.inset(t.unit(1.5F), t.unit());
  rest.cut_top(t.px(58));
  rest.min.x = std::max(rest.min.x, rest.max.x - t.px(186));
  widgets::toggle(ui, rest.cut_top(t.px(26), t.px(4)), "Grade line", measures.grade_on);
  if (!measures.grade_on) return;
  const double per_m = ui.units.convert(widgets::Quantity::kLength, 1);
  double height_m = measures.grade.point_m.y() - measures.zero_m();
  if (number_row(ui, rest.cut_top(t.px(26), t.px(4)),
                 {"height", "##height", "%.2f", ui.units.unit(widgets::Quantity::kLength), per_m, kHighest_m}, height_m,
                 measures))
    measures.grade.point_m.y() = measures.zero_m() + height_m;
  (void)number_row(ui, rest.cut_top(t.px(26), t.px(4)), {"slope", "##slope", "%.1f", "%", 100, kSteepest},
                   measures.grade.slope, measures);
  const widgets::Area buttons = rest.cut_top(t.px(28));
  if (widgets::button(ui, buttons.column(0, 2, t.px(4)), widgets::Icon::kNone, "to tip (T)"))
    measures.take = Measures::Take::kGradePoint;
  if (widgets::button(ui, buttons.column(1, 2, t.px(4)), widgets::Icon::kNone, "slope (Y)", false, measures.has_point))
    measures.take = Measures::Take::kGradeSlope;
}

}  // namespace knuckle::console::screens
