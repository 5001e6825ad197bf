// The console on a recording: no loop, no device, no link; only the window and what was recorded.
#pragma once

#include <functional>
#include <optional>

#include "app/console/player/load.h"
#include "app/console/screens/player_panel.h"
#include "app/console/window/console_options.h"

namespace knuckle::console::window {

/// What is beside a recording, as asked for; nothing where nothing is. @throws InputError
[[nodiscard]] std::optional<screens::Beside> beside_of(const ConsoleOptions& options, const player::Played& played);
/// @param keep_on asked each frame; false ends it. @return exit code. @throws InputError, one line.
[[nodiscard]] int run_player(const ConsoleOptions& options, const std::function<bool()>& keep_on);

}  // namespace knuckle::console::window
