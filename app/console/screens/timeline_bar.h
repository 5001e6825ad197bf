// Below every screen while a recording is played: its time line, and where on it the player is.
#pragma once

#include "app/console/screens/console_data.h"

namespace knuckle::console::screens {

/// Buttons, speed, time; events as marks, modes as a band, gaps hatched; scrubbed with the mouse.
void draw_timeline(const widgets::Ui& ui, const ConsoleData& data, widgets::Area area);
/// What stands beside the screens instead of hand, session and Stop: what is played, and what is beside it.
void draw_player_column(const widgets::Ui& ui, const ConsoleData& data, widgets::Area area);

/// Small for information, a triangle for a warning, a square for an alarm: the shape says as much as the colour.
void event_mark(const widgets::Theme& theme, Severity severity, float x, const widgets::Area& lane);

// Of the banner.
/// That this is no live machine. As wide as it is high times so much.
void draw_replay_block(const widgets::Ui& ui, const widgets::Area& area);
/// What stopped or limited the machine then.
[[nodiscard]] std::string replay_reason(const ConsoleView& view, const PlayerPanel& player);

}  // namespace knuckle::console::screens
