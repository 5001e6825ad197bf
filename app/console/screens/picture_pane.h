// How the largest pane of Operate is divided: the machine's picture, a camera's, and beside or below them, never over
// them, what there is to read and to press.
#pragma once

#include <optional>

#include "app/console/screens/console_data.h"
#include "app/console/screens/ui_state.h"
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
  Area machine;                ///< Its picture. Figures of the grid: on the right of it, and below.
  std::optional<Area> camera;  ///< The whole of a camera's picture.
  Area tools;                  ///< Title, switches, the grade line's settings.
  Area distances, legend;
  Area pad;  ///< Empty: none.
};
[[nodiscard]] PicturePane divide(const Theme& theme, Area pane, const PaneContents& has);

/// The largest area of this aspect inside another, at its top.
[[nodiscard]] Area fitted(const Area& into, double aspect);

// What is drawn over the machine's picture to judge distances by: the chosen ground, the grade line, where the bucket
// touched something, what it carries, and where it is when it is out of the picture; and beside it figures of the grid.

/// The grid of the side view; nothing in another.
[[nodiscard]] std::optional<picture::Grid> shown_grid(const Units& units, const UiState& state,
                                                      const picture::Camera& camera, const Area& picture);

/// @param picture where the machine's picture is. @param figures of the grid are drawn right of it and below.
void draw_marks(const Ui& ui, const ConsoleData& data, const UiState& state, const Area& picture, bool figures);

}  // namespace knuckle::console::screens
