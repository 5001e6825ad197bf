#include <unistd.h>

#include <algorithm>
#include <memory>

#include "app/bringup/device_probe.h"
#include "app/cli/interrupt.h"
#include "app/cli/json.h"
#include "app/console/window/console_program.h"
#include "app/pairing/chosen_link.h"
#include "app/programs/program_console.h"
#include "app/programs/program_options.h"
#include "app/session/scenario.h"
#include "core/error.h"
#include "machine/load.h"
#include "sim/person.h"

namespace knuckle::console::window {
namespace {

using cli::Json;
constexpr const char* kSchema = "knuckle-console/1";

/// Loops and the wires below them, in the order in which they are taken down.
struct Behind {
  std::unique_ptr<HidDevicePort> device;
  std::optional<pairing::ChosenLink> link;
  std::unique_ptr<ConsoleHost> host;
};

StationSetup station_setup(const ConsoleOptions& o, const screens::ConsoleFacts& facts) {
  StationSetup setup;
  setup.side.device = facts.device;
  setup.side.machine = facts.machine;
  setup.side.law = facts.device.feel.law;
  setup.side.start = random_start();
  setup.limb = sim::sample_limb(sim::LimbClass::kNormal, o.session.seed);
  for (std::size_t j = 0; j < kJoints; ++j) {
    const auto axis = static_cast<Eigen::Index>(j);
    setup.hand_rad[axis] = 0.5 * (facts.device.min_rad[j] + facts.device.max_rad[j]);
    setup.start_rad[axis] = 0.5 * (facts.machine.links[j].min_rad + facts.machine.links[j].max_rad);
  }
  setup.seed = o.session.seed;
  return setup;
}

/// That a console can play, whoever leads. One that does not fit this machine stays: choosing it says why.
std::vector<std::string> playable_scenarios(const MachineDescription& machine) {
  std::vector<std::string> names = config_names("scenario");
  std::erase_if(names, [&machine](const std::string& name) {
    try {
      const session::Scenario scenario = session::load_scenario(find_config("scenario", name), machine);
      return !scenario.faults.empty() || session::follows_recording(scenario);
    } catch (const InputError&) {
      return false;
    }
  });
  return names;
}

screens::ConsoleFacts facts_of(const ConsoleOptions& o) {
  screens::ConsoleFacts facts;
  const MachineDescription read =
      load_machine(find_config("machine", o.session.machine.empty() ? "solar015" : o.session.machine));
  facts.machine = calibrated(read);
  facts.device = device_for(facts.machine, o.session.device);
  facts.seed = o.session.seed;
  check_springs(facts.machine, facts.device);
  facts.hand = o.device == "keyboard"  ? HandSource::kKeyboard
               : o.device == "gamepad" ? HandSource::kGamepad
                                       : HandSource::kDevice;
  facts.peer = o.simulate ? "simulated" : o.link.address.empty() ? o.link.dial.peer : o.link.address;
  facts.scenarios = playable_scenarios(read);
  if (std::find(facts.scenarios.begin(), facts.scenarios.end(), o.session.scenario) == facts.scenarios.end())
    facts.scenarios.insert(facts.scenarios.begin(), o.session.scenario);
  return facts;
}

LogChoice log_of(const ConsoleOptions& o, const screens::ConsoleFacts& facts) {
  return {.options = o.log,
          .real = o.real(),
          .program = std::string("knuckle console ") + (o.simulate ? "--simulate" : "--connect") + " --machine " +
                     facts.machine.source + " --device " + o.device};
}

Behind behind(const ConsoleOptions& o, const screens::ConsoleFacts& facts, std::ostream* candump) {
  Behind b;
  b.device = bringup::open_leading_device(o.device, o.device_choice);
  if (o.simulate) {
    const auto led = o.demo ? LiveSession::Led::kByScenario : LiveSession::Led::kByPerson;
    b.host = std::make_unique<ConsoleHost>(o.session, led, b.device.get(), candump, log_of(o, facts));
  } else {
    b.link.emplace(pairing::ChosenLink::connect(o.link));
    b.host = std::make_unique<ConsoleHost>(station_setup(o, facts), b.link->link(), b.device.get(), log_of(o, facts));
  }
  return b;
}

void set_up(screens::UiState& state, const ConsoleOptions& o, const screens::ConsoleFacts& facts,
            const ConsoleHost& host) {
  state.screen = o.first_screen();
  state.units = o.imperial ? UnitSystem::kImperial : UnitSystem::kMetric;
  const auto chosen = std::find(facts.scenarios.begin(), facts.scenarios.end(), o.session.scenario);
  state.simulation.scenario = static_cast<int>(chosen - facts.scenarios.begin());
  state.simulation.demo = o.demo;
  if (host.session()) show_session(state, host);
}

Json result_json(const ConsoleOutcome& outcome) {
  return {{"schema", kSchema},
          {"version", cli::program_version()},
          {"ran_s", outcome.ran_s},
          {"frames", outcome.frames},
          {"frames_per_s", static_cast<double>(outcome.frames) / std::max(outcome.ran_s, 1e-9)},
          {"ui_cpu_share", outcome.ui_cpu_share},
          {"heap_growth_bytes", outcome.heap_growth_bytes},
          {"simulated_s", outcome.simulated_s},
          {"mode", outcome.mode},
          {"events_lost", outcome.events_lost},
          {"frames_lost", outcome.frames_lost}};
}

/// What happened to the link, and what became of control that changes hands by lines; the terminal has it, too.
std::vector<cli::News> tend_link(pairing::ChosenLink& link, programs::ControlInput& input,
                                 programs::ProgramConsole& console, Time now) {
  std::vector<cli::News> all = link.news();
  const auto home = [] { return std::string("home on two: hold its button on the screen"); };
  for (cli::News& done : programs::obey_control_lines(input, link, home)) all.push_back(std::move(done));
  for (const cli::News& news : all) console.event(now, news.what, news.kind);
  console.tend(now);
  return all;
}

/// A camera as given; where it is a simulated one, its place on the machine.
struct ChosenCamera {
  video::CameraSource source;
  std::optional<CameraDescription> mount;
};

/// @throws InputError for a simulated camera that is not in the machine's file.
std::vector<ChosenCamera> cameras_of(const ConsoleOptions& o, const MachineDescription& machine) {
  std::vector<ChosenCamera> chosen;
  for (const std::string& text : o.cameras) {
    chosen.push_back({camera_source(o, text), std::nullopt});
    const video::CameraSource& camera = chosen.back().source;
    if (camera.source != programs::kSimulatedCamera) continue;
    const CameraDescription* mount = find_camera(machine, camera.name);
    if (mount == nullptr) cli::refuse_option("--camera", text, machine.source + " has no [[camera]] of this name");
    chosen.back().mount = *mount;
  }
  return chosen;
}

void add_cameras(ConsoleWindow& window, const std::vector<ChosenCamera>& cameras) {
  for (const ChosenCamera& camera : cameras) {
    if (camera.mount)
      window.add_simulated_camera(*camera.mount);
    else
      window.cameras().add(feed_of(camera.source, window.bell()));
  }
}

int run(const ConsoleOptions& o) {
  check(o);
  const cli::InterruptGuard interrupt;
  if (!o.replay.empty()) return run_player(o, [&interrupt] { return !interrupt.pending(); });
  screens::ConsoleFacts facts = facts_of(o);
  const std::vector<ChosenCamera> cameras = cameras_of(o, facts.machine);
  programs::AskedOutput candump("--candump", o.candump),
      json("--json", o.json, programs::AskedOutput::Content::kResult);
  Behind loops = behind(o, facts, candump.stream());
  facts.unix_ns_at_zero = loops.host->unix_ns_at_zero();
  ConsoleWindow window(o.window(), facts);
  if (facts.hand == HandSource::kGamepad && !window.window().gamepad())
    cli::refuse_option("--device", o.device, "no gamepad found: plug one in, or use --device keyboard");
  set_up(window.state(), o, facts, *loops.host);
  add_cameras(window, cameras);

  programs::ProgramConsole console("knuckle console");
  programs::ControlInput input(STDIN_FILENO);
  if (loops.link) {
    for (const std::string& note : loops.link->notes()) console.note(note);
  }
  for (const std::string& note : loops.host->log().notes()) console.note(note);
  ConsoleRun run;
  run.keep_on = [&] { return !interrupt.pending(); };
  if (loops.link)
    run.link_news = [&] {
      if (std::optional<secure::VideoSecret> secret; loops.link->take(secret) && secret)
        window.cameras().set_keys([&secret](const std::string& name) { return secure::video_key(*secret, name); });
      return tend_link(*loops.link, input, console, loops.host->now());
    };
  constexpr double kPicture_s = 1;  // before, nothing was received that a picture could show
  run.skip_to_s = o.at_s.value_or(o.screenshot.empty() || o.duration_s ? 0 : kPicture_s);
  run.duration_s = o.duration_s.value_or(o.screenshot.empty() ? programs::kLongestRun_s : 0);
  run.screenshot = o.screenshot;
  if (o.simulate) run.simulated = o.session;
  if (o.screenshot.empty())
    window.make_sounds(o.mute);
  else
    window.hold_steady();
  run.pictures_per_s = o.pictures_per_s.value_or(0);
  run.candump = &candump;
  ConsoleOutcome outcome = run_console(window, *loops.host, run);
  if (loops.link) loops.link->close();  // the host has ended its loop
  for (const cli::News& news : loops.host->log().news()) console.note(news.what);
  if (outcome.frames_lost > 0)
    console.note(candump.name() + ": " + std::to_string(outcome.frames_lost) +
                 " frames are missing: the window was too slow to write them");
  outcome.frames_lost += programs::finish_records(console, {&candump});
  Json result = result_json(outcome);
  result["recording"] = loops.host->log().json();
  if (auto* out = json.stream()) *out << result.dump(2) << '\n';
  programs::commit_all({&candump, &json});
  return 0;
}

}  // namespace

cli::Command console_entry() {
  return {"console", "Operator's console, for a simulated machine or one reached over the link, or for a recording",
          [](const cli::OptionList& command) {
            const auto options = std::make_shared<ConsoleOptions>();
            add_options(command, *options);
            return [command, options] {
              options->given = [command](const char* option) { return command.given(option); };
              return run(*options);
            };
          }};
}

}  // namespace knuckle::console::window
