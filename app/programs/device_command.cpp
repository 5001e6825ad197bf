#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <utility>

#include "app/cli/interrupt.h"
#include "app/cli/json.h"
#include "app/cli/output_file.h"
#include "app/programs/device_program.h"
#include "app/programs/program_frame.h"
#include "app/programs/programs.h"
#include "app/session/options.h"
#include "app/session/scenario.h"
#include "core/error.h"
#include "machine/load.h"
#include "transport/hid_file_port.h"
#include "transport/hid_reports.h"
#include "transport/udp_link.h"

namespace knuckle::programs {
namespace {

using cli::Json;
constexpr const char* kSchema = "knuckle-device/1";

struct Options {
  std::string gadget, device = "knuckle1", machine = "solar015", scenario, limb, screen, descriptor;
  std::uint64_t seed = 1;
  std::uint32_t serial = 0;
  std::vector<std::string> faults;
  RunOptions run;
};

void add_options(const cli::OptionList& c, Options& o) {
  c.add_option("--gadget", o.gadget, "File of the HID gadget, such as /dev/hidg0");
  c.add_option("--device-file", o.device, "Haptic device to simulate: name or .toml file").show_default();
  c.add_option("--serial", o.serial, "Serial number it reports (default: the one in its file, or 1)");
  c.add_option("--scenario", o.scenario,
               "Scenario that the simulated operator follows: name or .toml file (default: holds the device still)");
  c.add_option("--machine", o.machine, "Machine that the simulated operator sees and moves").show_default();
  c.add_option("--operator", o.limb, "Arm of the simulated operator: relaxed, normal, co_contracted or light_grip");
  c.add_option("--screen", o.screen,
               "Address and port that receives the copy of the link traffic (knuckle master --mirror): what the "
               "simulated operator sees");
  c.add_option("--seed", o.seed, "Random seed of the arm, friction and cogging").show_default().check(cli::seed_error);
  c.add_option("--fault", o.faults, "Inject a fault: KIND@S[+D], from S seconds on for D seconds").one_value_each();
  o.run.add(c, "Write the simulation's true state as CSV, a row every 5 ms",
            "Write counters and events as JSON (described in docs/haptic-device.md)");
  c.add_option("--descriptor", o.descriptor, "Only write the HID report descriptor, for setting up a gadget");
}

void check_places(const Options& o) {
  cli::Places places;
  places.configuration("--device-file", o.device);
  places.configuration("--machine", o.machine);
  places.configuration("--scenario", o.scenario);
  places.input("--gadget", o.gadget);
  o.run.take(places);
  places.output("--descriptor", o.descriptor);
}

void check(const Options& o) {
  o.run.check();
  if (o.gadget.empty()) throw InputError("--gadget: is required, such as --gadget /dev/hidg0");
  if (!o.scenario.empty() && o.screen.empty()) {
    cli::refuse_option("--scenario", o.scenario, "needs --screen: the simulated operator must see the machine");
  }
  if (o.scenario.empty() && !o.screen.empty()) cli::refuse_option("--screen", o.screen, "needs --scenario");
}

DeviceProgramSetup set_up(const Options& o) {
  DeviceProgramSetup setup;
  setup.device = load_device(find_config("device", o.device));
  setup.plan.machine = calibrated(load_machine(find_config("machine", o.machine)));
  sim::LimbClass limb = sim::LimbClass::kNormal;
  sim::PersonClass person = sim::PersonClass::kExact;
  for (std::size_t i = 0; i < kJoints; ++i) {
    setup.start_rad[static_cast<Eigen::Index>(i)] = 0.5 * (setup.device.min_rad[i] + setup.device.max_rad[i]);
  }
  if (!o.scenario.empty()) {
    session::Scenario scenario = session::load_scenario(find_config("scenario", o.scenario), setup.plan.machine);
    for (const sim::Phase& phase : scenario.phases) {
      if (phase.kind != sim::PhaseKind::kPath) continue;
      cli::refuse_option("--scenario", o.scenario, "follows a recorded motion, which only knuckle simulate follows");
    }
    limb = session::limb_named(o.limb, scenario.limb);
    person = scenario.person;
    if (person != sim::PersonClass::kExact) session::check_strength(scenario, limb);
    setup.plan.phases = std::move(scenario.phases);
    setup.plan.phase_names = std::move(scenario.phase_names);
    setup.plan.reaction = scenario.reaction;
    setup.start_rad = scenario.hand_rad;
  }
  limb = session::limb_named(o.limb, limb);
  setup.limb = sim::sample_limb(limb, o.seed);
  setup.person = sim::sample_person(person, o.seed);
  if (person != sim::PersonClass::kExact) setup.limb.strength_N = sim::strength_N(limb);
  setup.seed = o.seed;
  setup.serial = o.serial;
  for (const std::string& fault : o.faults) setup.faults.push_back(parse_device_fault(fault));
  return setup;
}

Json result_json(const Options& o, const DeviceProgramOutcome& outcome) {
  Json json{{"device", o.device},
            {"scenario", o.scenario.empty() ? Json() : Json(o.scenario)},
            {"seed", o.seed},
            {"finished", outcome.finished}};
  json["phases"] = Json::array();
  for (const auto& phase : outcome.phases)
    json["phases"].push_back({{"name", phase.name}, {"began_s", phase.began_s}, {"timed_out", phase.timed_out}});
  json["latches"] = Json::array();
  for (const auto& latch : outcome.latches) json["latches"].push_back({{"at_s", latch.at_s}, {"fault", latch.fault}});
  json["faults"] = Json::array();
  for (const auto& fault : outcome.faults)
    json["faults"].push_back({{"fault", fault.text}, {"at_s", fault.at_s}, {"broken", fault.broken}});
  json["felt_peak_N"] = outcome.felt_peak_N;
  json["energy_to_hand_J"] = outcome.energy_to_hand_J;
  json["realtime"] = {{"device", loop_json(outcome.loop)}};
  return json;
}

int write_descriptor(const Options& o) {
  const std::array in_vain{std::pair{"--gadget", &o.gadget}, std::pair{"--csv", &o.run.csv},
                           std::pair{"--json", &o.run.json}};
  for (const auto& [option, value] : in_vain)
    if (!value->empty()) cli::refuse_option(option, *value, "does not go with --descriptor, which only writes that");
  cli::OutputFile file("--descriptor", o.descriptor);
  file.stream().write(reinterpret_cast<const char*>(kHidReportDescriptor.data()), kHidReportDescriptor.size());
  file.commit();
  return 0;
}

/// A gadget is made by the kernel's class hidg; any other device, such as /dev/null, would swallow what the hand does.
void check_gadget(const std::string& file) {
  struct stat device {};
  if (::stat(file.c_str(), &device) != 0) return;  // the port says why when it opens it
  std::error_code unknown;                         // no sysfs: nobody can tell
  const auto subsystem = std::filesystem::read_symlink(
      fmt::format("/sys/dev/char/{}:{}/subsystem", major(device.st_rdev), minor(device.st_rdev)), unknown);
  if (S_ISCHR(device.st_mode) && !unknown && subsystem.filename() != "hidg")
    cli::refuse_option("--gadget", file,
                       "is a device of the class " + subsystem.filename().string() + ", not of a HID gadget (hidg)");
}

int run(const Options& o) {
  check_places(o);
  if (!o.descriptor.empty()) return write_descriptor(o);
  check(o);
  const cli::InterruptGuard interrupt;
  const DeviceProgramSetup setup = set_up(o);
  ProgramFrame program("knuckle device", o.run, interrupt);
  std::optional<UdpLink> screen;
  if (!o.screen.empty()) screen.emplace(UdpLink::listen(o.screen));
  check_gadget(o.gadget);
  HidFilePort cable("--gadget", o.gadget);

  program.console.note("simulates " + setup.device.name + " on " + o.gadget);
  const DeviceProgramOutcome outcome =
      run_device(setup, cable, screen ? &*screen : nullptr, program.start(), program.csv.stream());
  program.finish(kSchema, result_json(o, outcome), outcome.ran_s, outcome.records_lost);
  const bool gave_up = std::any_of(outcome.phases.begin(), outcome.phases.end(),
                                   [](const DeviceProgramOutcome::Phase& phase) { return phase.timed_out; });
  return o.scenario.empty() || (outcome.finished && !gave_up) ? 0 : 1;
}

}  // namespace

cli::Command device_entry() {
  return cli::command<Options>("device", "Simulated haptic device: firmware and operator's hand on a USB gadget",
                               add_options, run);
}

}  // namespace knuckle::programs
