#include <unistd.h>

#include <array>
#include <memory>
#include <optional>
#include <utility>

#include "app/bringup/device_probe.h"
#include "app/cli/interrupt.h"
#include "app/cli/json.h"
#include "app/pairing/chosen_link.h"
#include "app/programs/master_program.h"
#include "app/programs/program_frame.h"
#include "app/programs/programs.h"
#include "app/recordings/program_log.h"
#include "app/session/scenario.h"
#include "app/session/session_setup.h"
#include "machine/load.h"
#include "transport/mirrored_link.h"
#include "transport/udp_link.h"

namespace knuckle::programs {
namespace {

using cli::Json;
constexpr const char *kSchema = "knuckle-master/2", *kProgram = "knuckle master";

struct Options {
  std::string machine, device, device_file, mirror, control;
  HidChoice choice;
  pairing::LinkOptions link;
  double assist_force_limit_N = 0;
  bool assist_stop_on_object = false;
  RunOptions run;
  recordings::LogOptions log;
};

void add_options(const cli::OptionList& c, Options& o) {
  c.add_option("--machine", o.machine, "Machine name or .toml file, the same as on the machine's side");
  c.add_option("--device", o.device, "How the haptic device is attached: hid (hidraw), usb (libusb), or none")
      .required();
  c.add_option("--device-file", o.device_file,
               "Haptic device name or .toml file (default: knuckle1, or knuckle1_MACHINE where there is one)");
  bringup::add_device_choice(c, o.choice);
  c.add_option("--connect", o.link.address,
               "Machine's side, HOST:PORT such as arm.example.org:5683, 192.0.2.7:5683 or [::1]:5683");
  pairing::add_link_options(c, o.link);
  c.add_flag("--observe", o.link.observe, "Hear the machine without controlling it; with --device none");
  pairing::add_dial_options(c, o.link.dial, secure::Role::kOperator);
  c.add_option("--mirror", o.mirror, "Send a copy of all link traffic to this HOST:PORT, for a display");
  c.add_option("--control", o.control, "Bilateral law: echo or cues (default: as the device's file says)");
  c.add_option("--assist-force-limit", o.assist_force_limit_N, "Force-limited approach: tip force in N, 0 = off");
  c.add_flag("--assist-stop-on-object", o.assist_stop_on_object,
             "Stop when the bucket meets something stiff while digging");
  o.run.add(c, "Write device state, set-point, force and the machine's reports as CSV, a row every 5 ms",
            "Write counters and events as JSON (described in docs/programs.md)");
  recordings::add_log_options(c, o.log);
}

/// An observer leads nothing: without a device, and without what leading needs.
void check_observer(const Options& o) {
  if (o.device != "none") cli::refuse_option("--observe", "", "goes with --device none");
  const std::array<std::pair<const char*, bool>, 9> in_vain{{{"--machine", !o.machine.empty()},
                                                             {"--device-file", !o.device_file.empty()},
                                                             {"--mirror", !o.mirror.empty()},
                                                             {"--control", !o.control.empty()},
                                                             {"--assist-force-limit", o.assist_force_limit_N != 0},
                                                             {"--assist-stop-on-object", o.assist_stop_on_object},
                                                             {"--csv", !o.run.csv.empty()},
                                                             {"--log", !o.log.folder.empty()},
                                                             {"--no-log", o.log.off}}};
  for (const auto& [option, given] : in_vain)
    if (given) cli::refuse_option(option, "", "does not go with --observe");
}

void check(const Options& o) {
  recordings::check_log(o.log);
  o.run.check();
  if (o.assist_force_limit_N != 0)
    cli::check_range("--assist-force-limit", o.assist_force_limit_N, session::kLeastAssist_N, session::kMostAssist_N,
                     " N, or 0: off");
  if (o.device != "hid" && o.device != "usb" && o.device != "none")
    cli::refuse_option("--device", o.device, "must be hid, usb or none");
  if (o.link.observe) check_observer(o);
  if (!o.link.observe && o.machine.empty())
    cli::refuse_option("--machine", "", "is required, unless --observe is given");
  if (o.device == "none") bringup::check_no_device_choice(o.choice, "goes with --device hid or usb");
  if (!o.control.empty() && !leading_law_named(o.control))
    cli::refuse_option("--control", o.control, kLeadingLawChoice);
  cli::Places places;
  places.configuration("--machine", o.machine);
  places.configuration("--device-file", o.device_file);
  o.run.take(places);
}

/// No device at all: the link and the machine's reports can be looked at without one.
class NoDevice final : public HidPort {
 public:
  bool write(const HidReport& /*report*/) noexcept override { return false; }
  bool read(HidReport& /*report*/) noexcept override { return false; }
  [[nodiscard]] bool connected() const noexcept override { return false; }
};

recording::OperatorSetup set_up(const Options& o) {
  recording::OperatorSetup setup;
  setup.machine = calibrated(load_machine(find_config("machine", o.machine)));
  setup.device = device_for(setup.machine, o.device_file);
  check_springs(setup.machine, setup.device);
  setup.law = control_law_named(o.control).value_or(setup.device.feel.law);
  setup.assist.force_limit_N = o.assist_force_limit_N;
  setup.assist.stop_on_object = o.assist_stop_on_object;
  setup.start = random_start();
  return setup;
}

recording::Head head_of(const Options& o, const recording::OperatorSetup& setup) {
  return session::operator_head("knuckle master --machine " + setup.machine.source + " --device " + o.device,
                                static_cast<std::int64_t>(1e9 * unix_time_s()), setup.machine, setup.device, setup.law,
                                setup.start);
}

/// Why no device was usable in a whole run.
std::string no_device_text(const Options& o, const HidDevicePort& device) {
  const std::string problem = device.status().problem;
  return "--device " + o.device + ": no haptic device was ready at any time" + (problem.empty() ? "" : ": " + problem) +
         ": see knuckle doctor --device " + o.device;
}

constexpr const char* kNeverHeard = "the machine was not heard at any time";

Json buses_json(const MachineStatus& status, const BusDescription& bus) {
  Json json = Json::array();
  for (std::size_t i = 0; i < bus.lines(); ++i)
    json.push_back(
        {{"name", bus.line(i).name}, {"load", status.buses[i].load}, {"state", name(status.buses[i].state)}});
  return json;
}

Json status_json(const std::optional<MachineStatus>& status, const BusDescription& bus) {
  if (!status) return nullptr;
  return {
      {"machine", status->machine.text()},          {"pilot_on", status->pilot_on}, {"buses", buses_json(*status, bus)},
      {"can_errors", status->can_errors},           {"loop_steps", status->steps},  {"loop_overruns", status->overruns},
      {"loop_fifo_priority", status->fifo_priority}};
}

Json connect_json(const Options& o) {
  return o.link.address.empty() ? Json() : Json(o.link.address);
}

Json machine_json(const MasterEvent& event, const BusDescription& bus) {
  return {{"at_s", to_seconds(event.at)},
          {"heard", event.heard},
          {"mode", event.heard ? Json(name(event.mode)) : Json()},
          {"blocking", reason_json(event.blocking, bus)},
          {"fault", reason_json(event.fault, bus)}};
}

Json result_json(const Options& o, const recording::OperatorSetup& setup, const MasterOutcome& outcome) {
  const BusDescription& bus = setup.machine.bus;
  Json json{{"machine", setup.machine.name},
            {"device", o.device},
            {"device_file", setup.device.name},
            {"connect", connect_json(o)},
            {"control", name(setup.law)}};
  json["machine_side"] = Json::array();
  json["device_states"] = Json::array();
  json["other_machine"] = Json::array();
  json["warnings"] = Json::array();
  for (const MasterEvent& event : outcome.events) {
    const double at_s = to_seconds(event.at);
    if (event.about == MasterEvent::About::kDevice) {
      json["device_states"].push_back(
          {{"at_s", at_s}, {"ready", !event.device}, {"why", reason_json(event.device, bus)}});
    } else if (event.about == MasterEvent::About::kSameMachine) {
      json["other_machine"].push_back({{"at_s", at_s},
                                       {"here", event.here.text()},
                                       {"there", event.there.text()},
                                       {"why", reason_json(event.other_machine, bus)}});
    } else if (event.about == MasterEvent::About::kFelt) {
      json["warnings"].push_back({{"at_s", at_s}, {"why", reason_json(event.warning, bus)}});
    } else {
      json["machine_side"].push_back(machine_json(event, bus));
    }
  }
  json["round_trip_ms"] = milliseconds_json(outcome.round_trip);
  json["machine_status"] = status_json(outcome.machine_status, bus);
  json["readings"] = readings_json(outcome.readings);
  json["realtime"] = {{"master", loop_json(outcome.loop)}};
  return json;
}

Json observer_json(const Options& o, const ObserverOutcome& outcome) {
  Json json{{"connect", connect_json(o)}, {"observed", true}, {"messages", outcome.messages}};
  json["machine_side"] = Json::array();
  for (const MasterEvent& event : outcome.events) json["machine_side"].push_back(machine_json(event, {}));
  return json;
}

int observe(const Options& o, const cli::InterruptGuard& interrupt) {
  ProgramFrame program(kProgram, o.run, interrupt);
  pairing::ChosenLink link = pairing::ChosenLink::connect(o.link);
  program.console.notes(link.notes());
  program.console.note("observing " + link.where() + ": nothing is controlled from here");
  program.run.news = [&link] { return link.news(); };
  const ObserverOutcome outcome = run_observer(link.link(), program.start());
  link.close();
  if (outcome.messages == 0) program.console.note(kNeverHeard);
  Json result = observer_json(o, outcome);
  result["path"] = path_json(link, program.started());
  program.finish(kSchema, result, outcome.ran_s, outcome.records_lost);
  return outcome.messages == 0 ? 1 : 0;
}

int run(const Options& o) {
  check(o);
  const cli::InterruptGuard interrupt;
  if (o.link.observe) return observe(o, interrupt);
  const recording::OperatorSetup setup = set_up(o);
  ProgramFrame program(kProgram, o.run, interrupt);
  pairing::ChosenLink link = pairing::ChosenLink::connect(o.link);
  std::optional<UdpLink> screen;
  std::optional<MirroredLink> mirrored;
  if (!o.mirror.empty()) mirrored.emplace(link.link(), screen.emplace(UdpLink::connect(o.mirror, "--mirror")));
  NoDevice nothing;
  const std::unique_ptr<HidDevicePort> device = bringup::open_leading_device(o.device, o.choice);

  recordings::ProgramLog log(o.log, o.device != "none", head_of(o, setup), setup.machine);
  log.begin();
  program.console.notes(link.notes());
  program.console.notes(log.notes());
  program.console.note("device " + setup.device.name + " (" + o.device + "), machine " + setup.machine.name + " at " +
                       link.where());
  ControlInput input(STDIN_FILENO);
  HomeRequest home;
  const auto ask_home = [&home]() -> std::string {
    if (!home.offered) return "home on two: the machine does not offer it";
    home.asked = true;
    return "home on two: asked for while enable is released";
  };
  program.run.news = [&] {
    std::vector<cli::News> news = link.news();
    for (cli::News& done : obey_control_lines(input, link, ask_home)) news.push_back(std::move(done));
    for (cli::News& recorded : log.news()) news.push_back(std::move(recorded));
    return news;
  };
  HidPort& port = device ? static_cast<HidPort&>(*device) : nothing;
  Link& wire = mirrored ? static_cast<Link&>(*mirrored) : link.link();
  const MasterOutcome outcome = run_master(
      setup, port, wire, program.start(), [&] { return device ? device->status().problem : ""; }, program.csv.stream(),
      log.recorder(), &home);
  link.close();
  log.close();
  for (const cli::News& news : program.run.news()) program.console.note(news.what);

  const bool without_device = device && !outcome.device_was_ready;
  if (without_device) program.console.note(no_device_text(o, *device));
  if (!outcome.machine_was_heard) program.console.note(kNeverHeard);
  Json result = result_json(o, setup, outcome);
  result["path"] = path_json(link, program.started());
  result["recording"] = log.json();
  program.finish(kSchema, result, outcome.ran_s, outcome.records_lost);
  return without_device || !outcome.machine_was_heard ? 1 : 0;
}

}  // namespace

cli::Command master_entry() {
  return cli::command<Options>("master", "Operator's side: lead a machine with a haptic device, without a screen",
                               add_options, run);
}

}  // namespace knuckle::programs
