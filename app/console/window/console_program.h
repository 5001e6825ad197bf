// The console as a program: window, loops and event book together, until the window is closed.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/cli/terminal.h"
#include "app/console/console_host.h"
#include "app/console/player/load.h"
#include "app/console/screens/player_panel.h"
#include "app/console/window/console_options.h"
#include "app/console/window/console_window.h"
#include "app/programs/program_options.h"

namespace knuckle::console::window {

struct ConsoleRun {
  std::function<bool()> keep_on;  ///< Asked each frame; false ends the program in order.
  /// Asked each frame: what happened to the link, for the Events screen and the recording; may be empty.
  std::function<std::vector<cli::News>()> link_news{};
  double skip_to_s = 0;     ///< A simulated session begins so late, at once.
  double duration_s = 1e9;  ///< Of running in real time.
  std::string screenshot;   ///< The last frame goes there; the window closes then. Empty: none.
  std::optional<session::SimulateOptions> simulated;  ///< What restarted sessions start from.
  double pictures_per_s = 0;                          ///< Of each camera, into the recording; 0: none.
  programs::AskedOutput* candump = nullptr;           ///< That the host writes to, if it does.
};

/// What it cost.
struct ConsoleOutcome {
  std::uint64_t frames = 0;
  double ran_s = 0;
  double ui_cpu_share = 0;             ///< Of one core, of this thread.
  std::int64_t heap_growth_bytes = 0;  ///< From a second after the beginning on.
  double simulated_s = 0;
  std::string mode;
  std::uint64_t events_lost = 0, frames_lost = 0;  ///< That there was no room for; frames of the simulated bus.
};

/// What the session begun next is made of. @param asked of the command line, which counts where the person chose
/// nothing.
[[nodiscard]] session::SimulateOptions next_session(const session::SimulateOptions& asked,
                                                    const screens::SimulationChoice& choice,
                                                    const screens::ConsoleFacts& facts);
/// Takes over what the session that was chosen last brings with it: link and assist. @param host with such a session.
void show_session(screens::UiState& state, const ConsoleHost& host);
/// @throws InputError where the screenshot cannot be written.
[[nodiscard]] ConsoleOutcome run_console(ConsoleWindow& window, ConsoleHost& host, const ConsoleRun& run);

// The console on a recording: no loop, no device, no link; only the window and what was recorded.

/// What is beside a recording, as asked for; nothing where nothing is. @throws InputError
[[nodiscard]] std::optional<screens::Beside> beside_of(const ConsoleOptions& options, const player::Played& played);
/// @param keep_on asked each frame; false ends it. @return exit code. @throws InputError, one line.
[[nodiscard]] int run_player(const ConsoleOptions& options, const std::function<bool()>& keep_on);

}  // namespace knuckle::console::window
