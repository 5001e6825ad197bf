#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <initializer_list>
#include <map>
#include <set>
#include <string_view>

#include "app/bringup/device_probe.h"
#include "app/cli/command.h"
#include "app/cli/output_file.h"
#include "app/console/keys.h"
#include "app/console/screens/screens.h"
#include "app/console/window/console_program.h"
#include "app/programs/program_options.h"
#include "app/session/scenario.h"
#include "core/error.h"
#include "transport/socket_address.h"
#include "video/sender.h"

namespace knuckle::console::window {
namespace {

/// As an option has it: "real-time".
std::string option_of(Screen screen) {
  std::string word = key_of(screen).what;
  for (char& c : word) c = c == ' ' ? '-' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return word;
}
/// "operate, link, ... or history"
std::string screens_listed(const char* before_last) {
  std::string all;
  for (const screens::ScreenOnRail& one : screens::kScreens)
    all += (all.empty() ? "" : &one == &screens::kScreens.back() ? before_last : ", ") + option_of(one.screen);
  return all;
}

struct Size {
  int width = 0, height = 0;
};

Size size_of(const std::string& text) {
  Size size;
  char rest = 0;
  constexpr int kLeastWidth = 1280, kLeastHeight = 720, kMost = 8192;
  if (std::sscanf(text.c_str(), "%dx%d%c", &size.width, &size.height, &rest) != 2 || size.width < kLeastWidth ||
      size.height < kLeastHeight || size.width > kMost || size.height > kMost)
    cli::refuse_option("--size", text, "must be WxH, from 1280x720 to 8192x8192");
  return size;
}

void refuse_given(const ConsoleOptions& o, std::initializer_list<const char*> options, const char* why) {
  for (const char* option : options)
    if (o.given(option)) cli::refuse_option(option, "", why);
}

/// Options that only a simulated session has a use for.
void check_simulated_only(const ConsoleOptions& o) {
  refuse_given(
      o, {"--scenario", "--seed", "--delay-ms", "--jitter-ms", "--loss", "--demo", "--candump", "--at", "--screenshot"},
      "goes with --simulate");
}

void check_device(const ConsoleOptions& o) {
  constexpr std::array<const char*, 4> kDevices{"keyboard", "gamepad", "hid", "usb"};
  if (std::find(kDevices.begin(), kDevices.end(), o.device) == kDevices.end())
    cli::refuse_option("--device", o.device, "must be keyboard, gamepad, hid or usb");
  if (o.device != "hid" && o.device != "usb")
    bringup::check_no_device_choice(o.device_choice, "goes with --device hid or usb");
  if (o.demo && (o.device == "hid" || o.device == "usb"))
    cli::refuse_option("--device", o.device, "does not go with --demo, where the scenario's operator leads");
}

constexpr std::string_view kFromSlave = "knuckle:";

void check_window(const ConsoleOptions& o) {
  cli::check_range("--scale", o.scale, 0.75, 3, "");
  cli::check_range("--duration", o.duration_s, 0.1, programs::kLongestRun_s, " s");
  (void)size_of(o.size);
  (void)o.first_screen();
  if (!o.screenshot.empty() && !o.screenshot.ends_with(".png"))
    cli::refuse_option("--screenshot", o.screenshot, "must end in .png: it is written as PNG");
  if (!o.screenshot.empty()) (void)cli::OutputFile("--screenshot", o.screenshot);  // refused before anything opens
}

/// What is played takes everything from its files, and leads nothing.
void check_replay(const ConsoleOptions& o) {
  refuse_given(o, {"--simulate",    "--connect", "--dial",     "--insecure",    "--keys",   "--machine",
                   "--device-file", "--serial",  "--usb-port", "--scenario",    "--seed",   "--delay-ms",
                   "--jitter-ms",   "--loss",    "--demo",     "--mute",        "--camera", "--candump",
                   "--json",        "--log",     "--no-log",   "--log-pictures"},
               "does not go with --replay");
  if (o.device != "keyboard") cli::refuse_option("--device", o.device, "does not go with --replay");
  if (o.changes.any() && !o.beside.empty())
    cli::refuse_option("--beside", o.beside.front(), "does not go with --with or --control: one run is shown beside");
  check_window(o);
  cli::Places places;
  for (const std::string& file : o.replay) places.input("--replay", file);
  for (const std::string& file : o.changes.with) places.configuration("--with", file);
  for (const std::string& file : o.beside) places.input("--beside", file);
  places.output("--screenshot", o.screenshot);
}

void check_pictures(const ConsoleOptions& o) {
  if (!o.pictures_per_s) return;
  cli::check_range("--log-pictures", o.pictures_per_s, 0.1, 30, " pictures a second");
  if (o.cameras.empty()) cli::refuse_option("--log-pictures", "", "needs --camera");
  if (o.log.off) cli::refuse_option("--log-pictures", "", "does not go with --no-log");
  if (!o.real() && o.log.folder.empty())
    cli::refuse_option("--log-pictures", "", "needs --log FOLDER: a simulated session is not recorded without");
}

void check_cameras(const ConsoleOptions& o) {
  std::set<std::string> names;
  std::map<std::string, std::string> ports;  // of what knuckle slave sends, and whose they are
  for (const std::string& text : o.cameras) {
    const video::CameraSource camera = camera_source(o, text);
    if (const std::size_t at = text.find(kFromSlave); at == camera.name.size() + 1) {
      const auto [taken, fresh] = ports.emplace(text.substr(text.rfind(':') + 1), camera.name);
      if (!fresh)
        cli::refuse_option("--camera", text,
                           "camera " + taken->second +
                               " has this port: knuckle slave sends its second camera to the next one, and so on");
    }
    if (!names.insert(camera.name).second)
      throw InputError("--camera " + camera.name + ": is given twice; each camera needs a name of its own");
    if (camera.source != programs::kSimulatedCamera)
      video::check_source(camera);
    else if (!o.simulate)
      cli::refuse_option("--camera", text, "a simulated camera goes with --simulate");
  }
}

}  // namespace

void add_options(const cli::OptionList& c, ConsoleOptions& o) {
  c.add_flag("--simulate", o.simulate, "Simulate the machine, in real time");
  c.add_option("--connect", o.link.address,
               "Machine's side, HOST:PORT such as arm.example.org:5683, 192.0.2.7:5683 or [::1]:5683");
  c.add_option("--replay", o.replay, "Show a recording (.mcap; of several parts all, in their order); nothing is led");
  c.add_option("--with", o.changes.with,
               "With --replay: its loops run again with this machine or device (name or .toml file), shown "
               "beside it");
  c.add_option("--control", o.changes.control, "With --replay: its loops run again with this bilateral law, likewise");
  c.add_option("--beside", o.beside, "With --replay: another recording, shown beside it");
  pairing::add_link_options(c, o.link);
  pairing::add_dial_options(c, o.link.dial, secure::Role::kOperator);
  c.add_option("--machine", o.session.machine, "Machine name or .toml file (default with --simulate: solar015)");
  c.add_option("--device", o.device,
               "Input: keyboard (and mouse), gamepad, or a haptic device attached by hid (hidraw) or usb (libusb)")
      .show_default();
  c.add_option("--device-file", o.session.device,
               "Haptic device name or .toml file (default: knuckle1, or knuckle1_MACHINE where there is one)");
  bringup::add_device_choice(c, o.device_choice);
  c.add_option("--scenario", o.session.scenario, "Scenario of the simulated session: name or .toml file")
      .show_default();
  c.add_option("--seed", o.session.seed, "Random seed of the simulated machine and its noise")
      .show_default()
      .check(cli::seed_error);
  c.add_option("--delay-ms", o.session.delay_ms, "Delay of the simulated link, one way");
  c.add_option("--jitter-ms", o.session.jitter_ms,
               "Jitter of the simulated link: half-width of the delay's variation, at most the delay");
  c.add_option("--loss", o.session.loss, "Share of datagrams lost on the simulated link, 0 to 0.9");
  c.add_option("--camera", o.cameras,
               "Camera, NAME=SOURCE: a URI such as rtsp://192.0.2.9/live or v4l2:///dev/video0, or a pipeline as "
               "gst-launch-1.0 takes it, knuckle:ADDR:PORT for what knuckle slave --camera sends, or, with --simulate, "
               "'simulated' for a camera of the machine file; for each "
               "camera once "
               "(docs/camera.md)")
      .value_name("NAME=SOURCE")
      .one_value_each();
  c.add_flag("--mute", o.mute, "No alarm sounds; N turns them on");
  c.add_flag("--demo", o.demo, "Let the scenario's operator lead the machine");
  c.add_option("--candump", o.candump, "Write every frame of the simulated bus in candump log format");
  recordings::add_log_options(c, o.log);
  c.add_option(
      "--log-pictures", o.pictures_per_s,
      "Record so many pictures a second of each camera, too, as JPEG, 0.1 to 30 (default: their stamps alone)");
  c.add_option("--size", o.size, "Size of the window in pixels, WxH, from 1280x720 to 8192x8192").show_default();
  c.add_option("--scale", o.scale,
               "Scale of the window's content, 0.75 to 3, on top of the monitor's own scale; reduced where the window "
               "has no room (default: by the window's size)");
  c.add_flag("--light", o.light, "Light colours");
  c.add_flag("--imperial", o.imperial, "Imperial units");
  c.add_option("--screen", o.screen, "Screen shown first: " + screens_listed(", ")).show_default();
  c.add_option("--at", o.at_s,
               "Show the simulated session, or the recording, from this second on; what comes before is simulated at "
               "once");
  c.add_option("--screenshot", o.screenshot,
               "Write a screenshot (.png) and exit: at --at (default: 1 s), or --duration later");
  c.add_option("--duration", o.duration_s, "Exit after so many seconds (default: when the window is closed)");
  c.add_option("--json", o.json, "Write the window's timing as JSON (described in docs/console.md)");
}

video::CameraSource camera_source(const ConsoleOptions& o, const std::string& text) {
  video::CameraSource camera = video::parse_source(text);
  if (!camera.source.starts_with(kFromSlave)) return camera;
  const std::string place = camera.source.substr(kFromSlave.size());
  if (place.find(' ') != std::string::npos)
    cli::refuse_option("--camera", text, "must be NAME=knuckle:ADDR:PORT without blanks");
  const SocketAddress address = parse_address(place, "--camera " + camera.name + "=" + std::string(kFromSlave));
  if (address.port() == 0) cli::refuse_option("--camera", text, "its port must be 1 to 65535");
  const bool sealed = !o.simulate && o.link.insecure == 0;
  if (!address.is_loopback() && !sealed && o.link.insecure < 2)
    cli::refuse_option(
        "--camera", text,
        "without a paired link pictures are not encrypted: they are taken at this computer's own addresses "
        "(127.0.0.1), or, in a lab, elsewhere where --insecure is given twice (docs/camera.md)");
  camera.source = video::receiver_of(address.port(), parse_host_and_port(place).host, sealed);
  return camera;
}

void check(const ConsoleOptions& o) {
  if (!o.replay.empty()) return check_replay(o);
  if (o.changes.any()) cli::refuse_option(o.changes.with.empty() ? "--control" : "--with", "", "goes with --replay");
  if (!o.beside.empty()) cli::refuse_option("--beside", o.beside.front(), "goes with --replay");
  const bool dials = !o.link.dial.rendezvous.empty();
  if (o.simulate == (dials || !o.link.address.empty()))
    throw InputError("console: give one of --simulate and --connect HOST:PORT or --dial HOST:PORT or --replay FILE");
  if (!o.simulate) {
    if (o.session.machine.empty())
      throw InputError("--machine: is required with --connect, the same as on the machine's side");
    check_simulated_only(o);
  } else {
    if (o.link.insecure > 0) cli::refuse_option("--insecure", "", "goes with --connect");
    if (!o.link.keys.empty()) cli::refuse_option("--keys", o.link.keys, "goes with --connect or --dial");
  }
  pairing::check(o.link.dial, secure::Role::kOperator, o.link.insecure > 0);
  check_device(o);
  check_cameras(o);
  recordings::check_log(o.log);
  check_pictures(o);
  check_window(o);
  cli::check_range("--at", o.at_s, 0, 600, " s");
  cli::check_range("--delay-ms", o.session.delay_ms, 0, session::kLongestDelay_ms, " ms");
  cli::check_range("--jitter-ms", o.session.jitter_ms, 0, 1000, " ms");
  cli::check_range("--loss", o.session.loss, 0, 0.9, "");
  cli::Places places;
  places.configuration("--machine", o.session.machine);
  places.configuration("--device-file", o.session.device);
  places.configuration("--scenario", o.session.scenario);
  places.output("--candump", o.candump);
  places.output("--screenshot", o.screenshot);
  places.output("--json", o.json);
}

WindowOptions ConsoleOptions::window() const {
  const Size asked = size_of(size);
  return {.title = "Knuckle console",
          .width = asked.width,
          .height = asked.height,
          .scale = static_cast<float>(scale.value_or(0)),
          .light = light,
          .full_speed = false};
}

Screen ConsoleOptions::first_screen() const {
  for (const screens::ScreenOnRail& one : screens::kScreens)
    if (option_of(one.screen) == screen) return one.screen;
  cli::refuse_option("--screen", screen, "must be " + screens_listed(" or "));
}

}  // namespace knuckle::console::window
