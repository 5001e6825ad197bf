// How the largest pane of Operate is divided: the machine's picture, a camera's, and beside or below them, never over
// them, what there is to read and to press.
#pragma once

#include <optional>

#include "app/console/widgets/area.h"
#include "app/console/widgets/theme.h"

namespace knuckle::console::screens {

struct PaneContents {
  bool figures = true;  ///< On the grid of a side view.
  bool pad = false;     ///< Buttons of Hold to run.
  bool grade = false;   ///< Settings of the grade line.
  std::optional<double> camera_aspect{};
  bool camera_large = false;
};

struct PicturePane {
  widgets::Area machine;                ///< Its picture. Figures of the grid: on the right of it, and below.
  std::optional<widgets::Area> camera;  ///< The whole of a camera's picture.
  widgets::Area tools;                  ///< Title, switches, the grade line's settings.
  widgets::Area distances, legend;
  widgets::Area pad;  ///< Empty: none.
};
[[nodiscard]] PicturePane divide(const widgets::Theme& theme, widgets::Area pane, const PaneContents& has);

/// The largest area of this aspect inside another, at its top.
[[nodiscard]] widgets::Area fitted(const widgets::Area& into, double aspect);

}  // namespace knuckle::console::screens
