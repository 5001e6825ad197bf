// The options of `knuckle console`, checked before anything opens.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/cli/options.h"
#include "app/console/screens/ui_state.h"
#include "app/console/window/window.h"
#include "app/pairing/chosen_link.h"
#include "app/programs/slave_cameras.h"
#include "app/recordings/program_log.h"
#include "app/replay/replay_command.h"
#include "app/session/options.h"
#include "transport/hid_device_port.h"
#include "video/source.h"

namespace knuckle::console::window {

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

}  // namespace knuckle::console::window
