// What heights in the picture are measured from, as the person chose it: a ground, and a grade line that is worked to.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "app/console/widgets/widgets.h"
#include "core/joints.h"

namespace knuckle::console::screens {

/// A line that is worked to, in the arm's plane; frame M.
struct GradeLine {
  PlanarVector point_m = PlanarVector::Zero();  ///< One that it passes through.
  double slope = 0;                             ///< Rise by metre forward.
  [[nodiscard]] double height_m(double forward_m) const { return point_m.y() + slope * (forward_m - point_m.x()); }
};

/// What heights are measured from, as the person chose it.
struct Measures {
  std::optional<double> ground_m;  ///< Frame M; where the tip touched the ground. None: the boom's pin.
  GradeLine grade;
  bool grade_on = false;
  /// What the tip's place is to be taken for, once.
  enum class Take : std::uint8_t { kNothing, kGround, kGradePoint, kGradeSlope };
  Take take = Take::kNothing;
  bool typed = false;      ///< Into one of its number fields, in the frame drawn last.
  bool has_point = false;  ///< The line goes through a place where the tip was.
  std::string said;        ///< What of the last wish was not done, in one line, for a while.
  double said_s = -1;      ///< Since when, by the window's clock; negative: not shown yet.
  [[nodiscard]] double zero_m() const { return ground_m.value_or(0); }
  /// Takes it, if anything. A slope needs a point that was taken, and a tip that is ahead of or behind it.
  void take_tip(const PlanarVector& tip_m);
  /// Where the tip is is not known: nothing is taken now, nor later.
  void drop();
  void say(const std::string& line);
};

/// The grade line's settings, below the other switches; each can be typed or taken from where the tip is.
void draw_grade_panel(const widgets::Ui& ui, Measures& measures, const widgets::Area& tools);
/// What was not done, at the top of the area; leaves the rest of it.
void draw_said(const widgets::Ui& ui, Measures& measures, widgets::Area& area);

}  // namespace knuckle::console::screens
