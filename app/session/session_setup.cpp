#include "app/session/session_setup.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "app/cli/command.h"
#include "app/session/link_file.h"
#include "app/session/operator_path.h"
#include "app/session/truth_file.h"
#include "core/error.h"
#include "machine/kinematics.h"
#include "machine/load.h"
#include "machine/room.h"
#include "sim/rigid_body.h"

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
  if (link.jitter > link.delay)  // no delay is below 0: the mean would be another
    throw InputError(fmt::format("--jitter-ms {:g}: must be at most the delay, {:g} ms: see --delay-ms",
                                 *options.jitter_ms, 1e3 * to_seconds(link.delay)));
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
  if (!options.contact_model.empty()) setup.machine = with_contact_model(setup.machine, options.contact_model);
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
  for (const std::string& note : machine_notes(setup.machine)) loaded.notes.push_back(note);
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

recording::OperatorSetup operator_setup(const SessionSetup& setup) {
  return {.device = setup.device,
          .machine = setup.machine,
          .law = setup.law,
          .start = setup.starts().operator_end,
          .assist = setup.scenario.assist,
          .far_end = master::FarEnd::kIsThisMachine};
}

sim::Operator operator_of(const SessionSetup& setup) {
  const Scenario& scenario = setup.scenario;
  return {setup.machine,
          scenario.phases,
          setup.path,
          kPathPeriod,
          scenario.hand_rad,
          scenario.reaction,
          sim::push_stiffness(setup.limb, setup.device.feel),
          sim::Unsteadiness(setup.person, setup.limb, setup.seed),
          setup.seed};
}

std::size_t most_frames(const BusDescription& bus, double duration_s) noexcept {
  constexpr double kSensors = 1 + 6 + 3 + 1, kValves = 3, kNodes = 6 + 3 + 3 + 2;  // the first with their SYNC
  constexpr double kSpare = 1.5, kSetUp = 4000;
  const double slow_Hz = 2 / bus.controller_heartbeat_s + 2 * kNodes / bus.node_heartbeat_s;
  const double frames_Hz =
      bus.sync_Hz * (kSensors + kValves / bus.set_point_every_nth_sync + kValves / bus.valve_status_every_nth_sync) +
      slow_Hz;
  return static_cast<std::size_t>(kSetUp + kSpare * frames_Hz * duration_s);
}

SessionRecord start_record(const SessionSetup& setup) {
  SessionRecord record;
  record.samples.reserve(static_cast<std::size_t>((setup.scenario.duration_s + 1) * setup.machine.bus.sync_Hz));
  record.phases = setup.scenario.phase_names;
  for (std::size_t i = 0; i < kJoints; ++i)
    record.most_radps[static_cast<Eigen::Index>(i)] = setup.machine.links[i].max_rate_radps;
  record.phases.emplace_back("hold");
  record.force_scale = setup.device.feel.force_scale;
  record.device_limit_N = setup.device.feel.force_limit_N;
  record.asked_N = asked_forces_N(setup.machine, setup.scenario, record.force_scale);
  record.link_delay_s = to_seconds(setup.to_machine.delay);
  for (Eigen::Index i = 0; i < kJoints; ++i) {
    const LinkDescription& link = setup.machine.links[static_cast<std::size_t>(i)];
    record.joint_end_low_rad[i] = link.min_rad + setup.machine.limits.joint_soft_margin_rad;
    record.joint_end_high_rad[i] = link.max_rad - setup.machine.limits.joint_soft_margin_rad;
  }
  return record;
}

namespace {

/// Of a free arm at the part of the bucket that is foremost along the press.
double moved_mass_kg(const MachineDescription& machine, const JointVector& joint_rad, const PlanarVector& along) {
  const auto outline = bucket_outline(machine);
  const Eigen::Rotation2Dd turn(joint_rad.sum());
  const PlanarVector foremost = turn * *std::ranges::max_element(outline, {}, [&](const PlanarVector& corner) {
                                  return along.dot(turn * corner);
                                });
  const sim::RigidBody body(machine, 0);
  const sim::PoseGeometry pose = body.pose(joint_rad);
  const JointVector torque = sim::RigidBody::bucket_torque(pose, along, cross(foremost, along));
  return 1 / torque.dot(body.mass(pose, {}).solve(torque));
}

/// 0 where nothing faces the press, or what does is no linear spring.
double pressed_stiffness_N_per_m(const sim::WorldDescription& world, const PlanarVector& along) {
  double facing = 0.5, stiffness = 0;  // within 60 deg
  const auto consider = [&](const PlanarVector& normal, double stiffness_N_per_m) {
    const double faces = -along.dot(normal.normalized());
    if (faces > facing) {
      facing = faces;
      stiffness = stiffness_N_per_m;
    }
  };
  for (const sim::WallDescription& wall : world.walls) {
    consider(wall.normal, wall.hunt_crossley_N_per_m15 > 0 ? 0 : wall.stiffness_N_per_m);
  }
  if (world.ground) consider(PlanarVector(0, 1), world.ground->stiffness_N_per_m);
  return stiffness;
}

}  // namespace

std::vector<double> asked_forces_N(const MachineDescription& machine, const Scenario& scenario, double force_scale) {
  const Kinematics kinematics(machine);
  JointVector joint_rad = scenario.start_rad;
  std::vector<double> asked_N;
  for (const sim::Phase& phase : scenario.phases) {
    asked_N.push_back(0);
    if (phase.kind == sim::PhaseKind::kMove) {
      joint_rad =
          phase.joint_space ? phase.joints_rad : kinematics.inverse(phase.tip_m, phase.bucket_rad).value_or(joint_rad);
    }
    if (phase.kind != sim::PhaseKind::kPress || phase.until_break) continue;
    const double stiffness = pressed_stiffness_N_per_m(scenario.world, phase.direction);
    if (stiffness <= 0) continue;
    const double impact_N = phase.speed_mps * std::sqrt(stiffness * moved_mass_kg(machine, joint_rad, phase.direction));
    asked_N.back() = phase.force_N / force_scale + impact_N;
  }
  return asked_N;
}

recording::Head session_head(const SessionSetup& setup, const SimulateOptions& options) {
  recording::Head head;
  head.program = "knuckle simulate --scenario " + options.scenario + " --seed " + std::to_string(setup.seed);
  if (!options.contact_model.empty()) head.program += " --contact-model " + options.contact_model;
  head.version = cli::program_version();
  head.virtual_time = !options.realtime;
  if (options.realtime) {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    head.started_unix_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
  }
  head.simulated = head.has_operator = head.has_machine = true;
  head.operator_start = setup.starts().operator_end;
  head.machine_start = setup.starts().machine_end;
  head.law = name(setup.law);
  head.far_end_is_this_machine = true;
  head.machine_file = setup.machine.text;
  head.device_file = setup.device.text;
  head.scenario_file = setup.scenario.text;
  return head;
}

recording::Head operator_head(const std::string& program, std::int64_t started_unix_ns,
                              const MachineDescription& machine, const DeviceDescription& device, ControlLaw law,
                              const LinkStart& start) {
  recording::Head head;
  head.program = program;
  head.version = cli::program_version();
  head.started_unix_ns = started_unix_ns;
  head.has_operator = true;
  head.operator_start = start;
  head.law = name(law);
  head.machine_file = machine.text;
  head.device_file = device.text;
  return head;
}

}  // namespace knuckle::session
