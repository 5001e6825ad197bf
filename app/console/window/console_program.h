// The console as a program: window, loops and event book together, until the window is closed.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/cli/command.h"
#include "app/cli/options.h"
#include "app/cli/terminal.h"
#include "app/console/console_host.h"
#include "app/console/player/load.h"
#include "app/console/screens/player_panel.h"
#include "app/console/screens/ui_state.h"
#include "app/console/window/console_window.h"
#include "app/console/window/window.h"
#include "app/pairing/chosen_link.h"
#include "app/programs/program_options.h"
#include "app/programs/slave_cameras.h"
#include "app/recordings/program_log.h"
#include "app/replay/replay_command.h"
#include "app/session/options.h"
#include "transport/hid_device_port.h"
#include "video/source.h"

namespace knuckle::console::window {

// The options of `knuckle console`, checked before anything opens.
struct ConsoleOptions {
  bool simulate = false, demo = false, light = false, imperial = false, mute = false;
  std::function<bool(const char* option)> given = [](const char*) { return false; };  ///< On the command line.
  session::SimulateOptions session;  ///< Machine and haptic device's file count with --connect, too.
  pairing::LinkOptions link;         ///< Its address is empty where the machine is simulated.
  recordings::LogOptions log;
  std::vector<std::string> replay;  ///< Parts of a recording to be shown; empty: something is led.
  std::vector<std::string> beside;  ///< Likewise, beside it.
  replay::Changes changes;          ///< Of its re-run, beside it.
  std::string device = "keyboard", candump;
  HidChoice device_choice;
  std::vector<std::string> cameras;  ///< NAME=SOURCE each; the source may be programs::kSimulatedCamera.
  std::optional<double> duration_s, at_s;
  std::optional<double> pictures_per_s;  ///< Of each camera, into the recording.
  std::optional<double> scale;           ///< None: by the window.
  std::string size = "1280x800", screen = "operate", screenshot, json;

  /// A haptic device, or a machine that is elsewhere: recorded unless turned off.
  [[nodiscard]] bool real() const { return !simulate || device == "hid" || device == "usb"; }
  [[nodiscard]] WindowOptions window() const;
  [[nodiscard]] Screen first_screen() const;
};

void add_options(const cli::OptionList& command, ConsoleOptions& options);
/// Of --camera NAME=SOURCE; "knuckle:ADDR:PORT" becomes the pipeline that receives what `knuckle slave --camera` sends.
/// @throws InputError where it is not that, or such a port is open to others and --insecure was not given twice.
[[nodiscard]] video::CameraSource camera_source(const ConsoleOptions& options, const std::string& text);
/// @throws InputError, one line.
void check(const ConsoleOptions& options);

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

// `knuckle console`: the operator's window.

[[nodiscard]] cli::Command console_entry();

}  // namespace knuckle::console::window
