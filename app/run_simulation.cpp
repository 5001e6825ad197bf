// What the command line asks for, loaded, run and handed over as one result.
#include <chrono>
#include <functional>
#include <ostream>
#include <utility>

#include "app/device_choice.h"
#include "app/digest.h"
#include "app/machine_pose.h"
#include "app/operator_path.h"
#include "app/realtime_session.h"
#include "app/scene.h"
#include "app/session.h"
#include "app/simulate.h"
#include "app/truth_file.h"
#include "core/error.h"
#include "machine/load.h"
#include "transport/virtual_can.h"

namespace knuckle::app {
namespace {

LinkImpairment impairment(const SimulateOptions& options, const Scenario& scenario) {
  LinkImpairment link;
  link.delay = from_seconds(1e-3 * options.delay_ms.value_or(scenario.delay_ms));
  link.jitter = from_seconds(1e-3 * options.jitter_ms.value_or(0.0));
  link.loss = options.loss.value_or(0.0);
  return link;
}

void refuse_impairment(const SimulateOptions& options) {
  for (const auto& [name, value] :
       {std::pair{"--delay-ms", options.delay_ms}, {"--jitter-ms", options.jitter_ms}, {"--loss", options.loss}}) {
    if (value) throw InputError(std::string(name) + ": needs virtual time; with --realtime the link is what it is");
  }
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
    throw InputError("--scenario " + name + ": follows a recorded motion; give --operator path:FILE.csv and --map");
  }
  if (!follows && !path.empty()) throw InputError("--scenario " + name + ": does not follow a recorded motion");
}

void describe(const SessionSetup& setup, SessionResult& result) {
  result.scenario = setup.scenario.name;
  result.machine_name = setup.machine.name;
  result.device_name = setup.device.name;
  result.control = setup.law == master::ControlLaw::kDirect ? "direct" : "echo_spring";
  result.seed = setup.seed;
  result.delay_ms = 1e3 * to_seconds(setup.to_machine.delay);
  result.jitter_ms = 1e3 * to_seconds(setup.to_machine.jitter);
  result.loss = setup.to_machine.loss;
  result.criteria = setup.scenario.criteria;
  result.machine = setup.machine;
}

/// The simulator's machine is drawn around the file as it was read; everything above the wires sees it as calibrated.
void draw_machine(const SimulateOptions& options, SessionSetup& setup) {
  setup.truth =
      options.truth.empty() ? sim::draw_truth(setup.machine, options.seed) : load_truth(options.truth, setup.machine);
  setup.machine = calibrated(setup.machine);
}

SessionSetup set_up(const SimulateOptions& options, SessionResult& result) {
  SessionSetup setup;
  if (options.realtime) refuse_impairment(options);
  setup.machine = load_machine(find_config("machine", options.machine.empty() ? "solar015" : options.machine));
  setup.device = device_for(setup.machine, options.device);
  check_springs(setup.machine, setup.device);
  setup.scenario = load_scenario(find_config("scenario", options.scenario), setup.machine);
  setup.seed = options.seed;
  draw_machine(options, setup);
  const std::string recording = options.operator_path();
  if (!recording.empty()) {
    OperatorPath path = load_operator_path(recording, options.map, setup.machine);
    setup.path = std::move(path.points);
    result.notes = std::move(path.notes);
  }
  allow_for_path(setup.scenario, setup.path, options.scenario);
  if (options.assist_force_limit_N) setup.scenario.assist.force_limit_N = *options.assist_force_limit_N;
  setup.scenario.assist.stop_on_object |= options.assist_stop_on_object;
  if (options.duration_s) setup.scenario.duration_s = *options.duration_s;
  const sim::LimbClass limb =
      limb_named(recording.empty() ? options.operator_name : "", setup.scenario.limb, " or path:FILE.csv");
  setup.limb = sim::draw_limb(limb, options.seed);
  if (!options.realtime) setup.to_machine = setup.to_operator = impairment(options, setup.scenario);
  setup.law = options.control == "direct" ? master::ControlLaw::kDirect : master::ControlLaw::kEchoSpring;
  result.operator_name = recording.empty() ? sim::name(limb) : options.operator_name;
  describe(setup, result);
  return setup;
}

HopLatency hop(const char* name, const Histogram& h) {
  const auto us = [](Duration d) { return 1e6 * to_seconds(d); };
  return {name, h.count(), {us(h.quantile(0.5)), us(h.quantile(0.99)), us(h.max())}};
}

std::string digest_of(const SessionRecord& record, const FrameLog& frames) {
  Digest digest;
  for (const Sample& sample : record.samples) digest.add(sample);
  for (const TimedFrame& frame : frames) digest.add(frame.at, frame.frame);
  return digest.finish();
}

std::vector<HopLatency> hops_of(const HopHistograms& h) {
  return {hop("hand_to_master", h.hand_to_master),   hop("master_to_slave", h.master_to_slave),
          hop("hand_to_valve", h.hand_to_valve),     hop("pressure_to_slave", h.pressure_to_slave),
          hop("slave_to_master", h.slave_to_master), hop("pressure_to_hand", h.pressure_to_hand)};
}

SessionOutcome run_on_virtual_time(const SessionSetup& setup, const std::function<void(double)>& progress) {
  Session session(setup);
  for (int tick = 0; !session.done(); ++tick) {
    session.step();
    if (progress && tick % 2000 == 0) progress(session.done_fraction());
  }
  SessionOutcome outcome;
  outcome.elapsed_s = session.elapsed_s();
  outcome.record = session.take_record();
  outcome.frames = session.frames();
  outcome.hops = session.hops();
  return outcome;
}

}  // namespace

SessionResult run_simulation(const SimulateOptions& options, const SessionHooks& hooks) {
  SessionResult result;
  const SessionSetup setup = set_up(options, result);
  const auto start = std::chrono::steady_clock::now();
  SessionOutcome outcome =
      options.realtime ? run_realtime(setup, hooks.progress) : run_on_virtual_time(setup, hooks.progress);
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (hooks.progress) hooks.progress(1);
  result.simulated_s = outcome.elapsed_s;
  result.record = std::move(outcome.record);
  result.hops = hops_of(outcome.hops);
  result.loops = std::move(outcome.loops);
  result.digest = digest_of(result.record, outcome.frames);
  result.scene = scene_of(setup.scenario.world, result.record, reach_m(setup.machine));
  if (hooks.candump != nullptr) {
    for (const TimedFrame& f : outcome.frames) *hooks.candump << candump_line(f.at, f.frame) << '\n';
  }
  return result;
}

}  // namespace knuckle::app
