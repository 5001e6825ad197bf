// What surrounds every screen: the rail that leads to the others, and the column with hand, session and Stop.
#pragma once

#include "app/window/console_data.h"
#include "app/window/ui_state.h"

namespace knuckle::app {

void draw_rail(const Ui& ui, const ConsoleData& data, UiState& state, Area area);
void draw_side_column(const Ui& ui, const ConsoleData& data, UiState& state, Area area);
void draw_stop(const Ui& ui, UiState& state, Area area);
void draw_help(const Ui& ui, const Area& area);

}  // namespace knuckle::app
