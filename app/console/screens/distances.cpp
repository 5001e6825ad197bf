#include "app/console/screens/distances.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "app/console/machine_text.h"
#include "app/console/screens/console_data.h"

namespace knuckle::console::screens {

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

void draw_distances(const widgets::Ui& ui, const ConsoleData& data, const UiState& state, const widgets::Area& area) {
  if (measured_freshness(data.view).after(ui.view_age_s).stale()) return;
  const widgets::Theme& t = ui.theme;
  const PlanarVector tip_m = data.kinematics.tip(data.view.machine.position_rad);
  const float number = area.min.x + t.px(70), label = number + t.unit();
  float y = area.min.y + t.px(12);
  for (const Distance& d : distances(tip_m, state.measures, data.facts.machine.limits, data.contacts)) {
    widgets::put_text(t.fonts.mono_small, t.colours.text, {number, y}, widgets::Align::kRight,
                      widgets::shown("%s%s", d.has_sign && d.m >= 0 ? "+" : "",
                                     ui.units.text(widgets::Quantity::kLength, d.m).c_str())
                          .c_str());
    widgets::put_fitted(t.fonts.small, t.colours.muted, {{label, y - t.px(9)}, {area.max.x, y + t.px(9)}}, d.label);
    y += t.px(20);
  }
}

}  // namespace knuckle::console::screens
