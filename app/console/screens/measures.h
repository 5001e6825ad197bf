// What heights in the picture are measured from, as the person chose it: a ground, and a grade line that is worked to.
#pragma once

#include <cstdint>
#include <optional>

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
  [[nodiscard]] double zero_m() const { return ground_m.value_or(0); }
  /// Takes it, if anything. A slope needs a tip that is ahead of or behind the line's point.
  void take_tip(const PlanarVector& tip_m);
};

/// The grade line's settings, into the picture's upper right below the other choices; each can be typed or taken from
/// where the tip is.
void draw_grade_panel(const widgets::Ui& ui, Measures& measures, const widgets::Area& picture);

}  // namespace knuckle::console::screens
