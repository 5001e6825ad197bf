// What is drawn over the machine's picture to judge distances by: figures on the grid, the chosen ground, the grade
// line, where the bucket touched something, and what it carries.
#pragma once

#include <optional>

#include "app/console/screens/console_data.h"
#include "app/console/screens/ui_state.h"

namespace knuckle::console::screens {

/// The grid of the side view; nothing in another.
[[nodiscard]] std::optional<picture::Grid> shown_grid(const widgets::Units& units, const UiState& state,
                                                      const picture::Camera& camera, const widgets::Area& picture);

/// @param picture where the machine's picture is. @param covered a part of it that shows something else; empty: none.
void draw_marks(const widgets::Ui& ui, const ConsoleData& data, const UiState& state, const widgets::Area& picture,
                const widgets::Area& covered);

}  // namespace knuckle::console::screens
