#include "app/session/session_setup.h"

#include <utility>

#include "app/session/link_file.h"
#include "app/session/operator_path.h"
#include "app/session/truth_file.h"
#include "core/error.h"
#include "machine/load.h"
#include "machine/room.h"

namespace knuckle::session {
namespace {

void impair(const SimulateOptions& options, LoadedSession& loaded) {
  SessionSetup& setup = loaded.setup;
  if (!options.impairment.empty()) {
    const LinkFile file = load_link(find_config("link", options.impairment));
    setup.to_machine = file.to_machine;
    setup.to_operator = file.to_operator;
    if (!file.to_machine.address_changes.empty() || !file.to_operator.address_changes.empty())
      loaded.notes.push_back(file.source + ": address changes do nothing on virtual time, which has no addresses");
    return;
  }
  LinkImpairment link;
  link.delay = from_seconds(1e-3 * options.delay_ms.value_or(setup.scenario.delay_ms));
  link.jitter = from_seconds(1e-3 * options.jitter_ms.value_or(0.0));
  link.loss = options.loss.value_or(0.0);
  link.bursts_per_s = options.bursts_per_s.value_or(0.0);
  setup.to_machine = setup.to_operator = link;
}

void refuse_impairment(const SimulateOptions& options) {
  for (const auto& [name, value] : {std::pair{"--delay-ms", options.delay_ms},
                                    {"--jitter-ms", options.jitter_ms},
                                    {"--loss", options.loss},
                                    {"--bursts-per-s", options.bursts_per_s}}) {
    if (value)
      throw InputError(std::string(name) + ": cannot be set with --realtime, which uses the real loopback link");
  }
  if (!options.impairment.empty())
    throw InputError(
        "--impairment: cannot be set with --realtime: let `knuckle relay` impair the link between --listen "
        "and --connect");
}

/// A recording takes its own time, whatever else the plan allows for.
/// @throws InputError where the plan follows a recording and there is none, or the other way round.
void allow_for_path(Scenario& scenario, const std::vector<sim::PathPoint>& path, const std::string& name) {
  const double played_s = to_seconds(kPathPeriod) * static_cast<double>(path.size());
  bool follows = false;
  for (sim::Phase& phase : scenario.phases) {
    if (phase.kind != sim::PhaseKind::kPath) continue;
    follows = true;
    phase.timeout_s += played_s;
    scenario.duration_s += played_s;
  }
  if (follows && path.empty()) {
    throw InputError("--scenario " + name +
                     ": follows a recorded motion; give --operator path:FILE.csv and --map, or path:FILE.mcap");
  }
  if (!follows && !path.empty()) throw InputError("--scenario " + name + ": does not follow a recorded motion");
}

/// The simulator's machine is sampled around the file as it was read; everything above the wires sees it as calibrated.
void sample_machine(const SimulateOptions& options, SessionSetup& setup) {
  const sim::Family family = family_named(options.family);
  setup.truth = truth_for(setup.machine, options.truth, options.family, setup.machine_seed);
  if (options.machine_seed) setup.truth = sim::another_day(setup.truth, family, options.seed);
  if (family != sim::Family::kSmooth) setup.built_device = sim::sample_device(setup.device, family, options.seed);
  setup.machine = calibrated(setup.machine);
}

}  // namespace

LoadedSession load_session(const SimulateOptions& options, bool follows_plan) {
  LoadedSession loaded;
  SessionSetup& setup = loaded.setup;
  if (options.realtime) refuse_impairment(options);
  setup.machine = load_machine(find_config("machine", options.machine.empty() ? kDefaultMachine : options.machine));
  setup.device = device_for(setup.machine, options.device);
  check_springs(setup.machine, setup.device);
  setup.scenario = options.scenario_text.empty()
                       ? load_scenario(find_config("scenario", options.scenario), setup.machine)
                       : parse_scenario(options.scenario_text, options.scenario, setup.machine);
  setup.seed = options.seed;
  setup.machine_seed = options.machine_seed.value_or(options.seed);
  sample_machine(options, setup);
  if (!options.listen.empty()) setup.listen = options.listen;
  setup.connect = options.connect;
  const std::vector<std::string> recorded = options.operator_paths();
  if (!recorded.empty()) {
    OperatorPath path = load_operator_path(recorded, options.map, setup.machine);
    setup.path = std::move(path.points);
    loaded.notes = std::move(path.notes);
  }
  for (const std::string& note : limit_notes(setup.machine)) loaded.notes.push_back(note);
  if (follows_plan) allow_for_path(setup.scenario, setup.path, options.scenario);
  if (options.assist_force_limit_N) setup.scenario.assist.force_limit_N = *options.assist_force_limit_N;
  setup.scenario.assist.stop_on_object |= options.assist_stop_on_object;
  loaded.shortened = options.duration_s && *options.duration_s < setup.scenario.duration_s;
  if (options.duration_s) setup.scenario.duration_s = *options.duration_s;
  const sim::LimbClass limb = limb_named(recorded.empty() ? options.operator_name : "", setup.scenario.limb,
                                         ", or path:FILE.csv with --map, or path:FILE.mcap");
  setup.limb = sim::sample_limb(limb, options.seed);
  const sim::PersonClass person = person_named(options.person, setup.scenario.person);
  setup.person = sim::sample_person(person, options.seed);
  if (person != sim::PersonClass::kExact) {
    check_strength(setup.scenario, limb);
    setup.limb.strength_N = sim::strength_N(limb);
  }
  if (!options.realtime) impair(options, loaded);
  setup.law = control_law_named(options.control).value_or(setup.device.feel.law);
  loaded.operator_name = recorded.empty() ? sim::name(limb) : options.operator_name;
  return loaded;
}

}  // namespace knuckle::session
