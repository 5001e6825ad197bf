// What surrounds every screen: the rail that leads to the others, and the column with hand, session and Stop.
#pragma once

#include "app/console/screens/console_data.h"
#include "app/console/screens/ui_state.h"

namespace knuckle::console::screens {

void draw_rail(const widgets::Ui& ui, const ConsoleData& data, UiState& state, widgets::Area area);
void draw_side_column(const widgets::Ui& ui, const ConsoleData& data, UiState& state, widgets::Area area);
void draw_stop(const widgets::Ui& ui, UiState& state, widgets::Area area);
/// @param playing a recording: its keys.
void draw_help(const widgets::Ui& ui, bool playing, const widgets::Area& area);

}  // namespace knuckle::console::screens
