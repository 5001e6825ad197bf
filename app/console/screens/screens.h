// The screens: free functions from the newest view to widgets; what the person changes goes into the state.
#pragma once

#include <optional>
#include <string>

#include "app/console/screens/console_data.h"
#include "app/console/screens/ui_state.h"

namespace knuckle::console::screens {

/// @return where the machine's picture goes.
[[nodiscard]] widgets::Area operate_screen(const widgets::Ui& ui, const ConsoleData& data, UiState& state,
                                           widgets::Area area);
/// Scales and assists: what is in use, and what is requested where that differs.
void scales_card(const widgets::Ui& ui, const ConsoleData& data, UiState& state, const widgets::Area& area);
void link_screen(const widgets::Ui& ui, const ConsoleData& data, widgets::Area area);
void real_time_screen(const widgets::Ui& ui, const ConsoleData& data, widgets::Area area);
void hydraulics_screen(const widgets::Ui& ui, const ConsoleData& data, widgets::Area area);
void events_screen(const widgets::Ui& ui, const ConsoleData& data, UiState& state, widgets::Area area);
void history_screen(const widgets::Ui& ui, const ConsoleData& data, const UiState& state, widgets::Area area);
/// What is known of this machine beside its drawing, from where, and how surely.
void calibration_screen(const widgets::Ui& ui, const ConsoleData& data, widgets::Area area);

/// Opens the one window of ImGui's, without a frame of its own and as large as ours; ImGui::End() closes it.
void open_canvas();
/// Everything on screen for one frame, into the open canvas. @return where the
/// machine's picture goes, on the screen that has one.
std::optional<widgets::Area> draw_console(const widgets::Ui& ui, const ConsoleData& data, UiState& state);

/// All limits being hit: chips in rows, or, where they have no room, their words alone. @return false where nothing is
/// limited.
bool limit_chips(const widgets::Ui& ui, const ConsoleData& data, const widgets::Area& area);
/// Why the force is not known better, in a few words, as reported by the machine's side.
[[nodiscard]] std::string confidence_words(const ConsoleView& view);

}  // namespace knuckle::console::screens
