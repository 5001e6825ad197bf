// What is drawn over the machine's picture to judge distances by: the chosen ground, the grade line, where the bucket
// touched something, what it carries, and where it is when it is out of the picture; and beside it figures of the grid.
#pragma once

#include <optional>

#include "app/console/screens/console_data.h"
#include "app/console/screens/ui_state.h"

namespace knuckle::console::screens {

/// The grid of the side view; nothing in another.
[[nodiscard]] std::optional<picture::Grid> shown_grid(const widgets::Units& units, const UiState& state,
                                                      const picture::Camera& camera, const widgets::Area& picture);

/// @param picture where the machine's picture is. @param figures of the grid are drawn right of it and below.
void draw_marks(const widgets::Ui& ui, const ConsoleData& data, const UiState& state, const widgets::Area& picture,
                bool figures);

}  // namespace knuckle::console::screens
