#include "app/studies/battery_machine.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "app/cli/interrupt.h"
#include "app/identify/scores.h"
#include "app/studies/force_scores.h"
#include "core/error.h"
#include "core/seed.h"
#include "estimation/identification/baseline.h"
#include "machine/kinematics.h"

namespace knuckle::studies {
namespace {

// How near the calibrated geometry and valves are to the simulated machine's.

JointVector lever_error(const MachineDescription& machine, MachineDescription truth) {
  // The true linkage may need a little more stroke than the drawing's cylinder has.
  constexpr double kRoom_m = 0.01;
  for (CylinderDescription& cylinder : truth.cylinders) {
    cylinder.min_length_m -= kRoom_m;
    cylinder.max_length_m += kRoom_m;
  }
  constexpr int kSteps = 40;
  const Kinematics kinematics(machine), true_kinematics(truth);
  JointVector relative;
  for (int joint = 0; joint < kJoints; ++joint) {
    const LinkDescription& link = machine.links[static_cast<std::size_t>(joint)];
    double errors = 0, squares = 0;
    for (int i = 0; i <= kSteps; ++i) {
      const double angle = link.min_rad + (link.max_rad - link.min_rad) * i / kSteps;
      const auto model = kinematics.cylinder_at(joint, angle), real = true_kinematics.cylinder_at(joint, angle);
      if (!model || !real) continue;
      errors += std::pow(model->lever_m - real->lever_m, 2);
      squares += std::pow(real->lever_m, 2);
    }
    relative[joint] = std::sqrt(errors / squares);
  }
  return relative;
}

/// tip_median_m and nominal_tip_median_m: held-out surveyed poses, the surveyor's error included. lever.JOINT and
/// nominal_lever.JOINT: RMS error of dL/dtheta over the working range / its RMS. dead_band: worst of six, fraction of
/// spool stroke. delay_s, flow: worst of three, the flow's relative.
Row score_commissioning(const MachineDescription& nominal, const identify::Commissioned& found,
                        const sim::MachineTruth& truth) {
  double dead_band = 0, delay_s = 0, flow = 0;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const ValveCalibration& valve = found.valves.valves[i];
    const ValveDescription& real = truth.machine.cylinders[i].valve;
    dead_band = std::max({dead_band, std::abs(valve.dead_band_extend - real.dead_band_extend),
                          std::abs(valve.dead_band_retract - real.dead_band_retract)});
    delay_s = std::max(delay_s, std::abs(valve.delay_s - real.delay_s));
    flow = std::max(flow, std::abs(valve.nominal_flow_m3ps / real.nominal_flow_m3ps - 1));
  }
  Row metrics{{"tip_median_m", metric(found.geometry.held_out.median_m)},
              {"nominal_tip_median_m", metric(found.geometry.nominal.median_m)},
              {"dead_band", metric(dead_band)},
              {"delay_s", metric(delay_s)},
              {"flow", metric(flow)}};
  add_joints(metrics, "lever", lever_error(calibrated(found.machine), truth.machine));
  add_joints(metrics, "nominal_lever", lever_error(nominal, truth.machine));
  return metrics;
}

constexpr double kCompare_Hz = 2;
constexpr double kMalaguti_s = 40;         // what the paper recorded
constexpr std::size_t kMalagutiEvery = 2;  // 200 Hz to its 100 Hz

/// A machine is driven for minutes: for MachineRun::watch().
void watch_for_interrupt(double /*elapsed_s*/) {
  cli::check_interrupt();
}

/// Two runs as one comparison.
estimation::TorqueComparison joined(estimation::TorqueComparison first, const estimation::TorqueComparison& second) {
  first.measured_Nm.insert(first.measured_Nm.end(), second.measured_Nm.begin(), second.measured_Nm.end());
  first.modelled_Nm.insert(first.modelled_Nm.end(), second.modelled_Nm.begin(), second.modelled_Nm.end());
  first.usable.insert(first.usable.end(), second.usable.begin(), second.usable.end());
  return first;
}

Row method_row(const std::string& method) {
  return {{"method", method}, {"identified", true}, {"usable", true}, {"metrics", Row::object()}};
}

void object_to(Row& method, const std::string& reason) {
  method["usable"] = false;
  method["reason"] = reason;
}

/// @return whether there is a result to judge.
bool take(const estimation::Identification& summary, Row& method) {
  method["identified"] = summary.usable;
  if (!summary.usable) object_to(method, summary.reasons.front());
  return summary.usable;
}

/// @return the fit up to kCompare_Hz.
estimation::TorqueFit judge_torque(const estimation::TorqueComparison& slow,
                                   const estimation::TorqueComparison& digging, const PerJoint<bool>& modelled,
                                   Row& method) {
  const std::string name = method["method"].get<std::string>();
  const std::vector<std::string> against = identify::objections(
      std::array{identify::held_out("slow", name, slow), identify::held_out("digging", name, digging)}, modelled);
  if (!against.empty()) object_to(method, against.front());
  const estimation::TorqueComparison both = joined(slow, digging);
  const estimation::TorqueFit smooth = estimation::torque_fit(both, kCompare_Hz);
  add_joints(method["metrics"], "torque_2Hz", smooth.nrmse);
  add_joints(method["metrics"], "torque_raw", estimation::torque_fit(both, 0).nrmse);
  return smooth;
}

Row judge_full(const std::string& name, const MachineDescription& machine, const estimation::FullOptions& options,
               const estimation::FullResult& full, const identify::CommissionRuns& runs, const Trials& trials,
               double hull_pitch_rad) {
  cli::check_interrupt();
  Row method = method_row(name);
  if (!take(full.summary, method)) return method;
  MachineDescription seen = calibrated(machine);
  const auto compare = [&](const motion::MachineRecording& run) {
    return estimation::compare_torque(full.dynamics, seen, run.recording, options);
  };
  const estimation::TorqueFit smooth =
      judge_torque(compare(runs.validation_slow), compare(runs.validation_digging), {true, true, true}, method);
  seen.dynamics_calibration = full.dynamics;
  seen.dynamics_calibration->residual_rms_Nm = smooth.rms_Nm;
  const identify::ParameterScores parameters =
      identify::score_parameters(seen, runs, full.dynamics, full.summary.covariance, hull_pitch_rad);
  Row& metrics = method["metrics"];
  add_joints(metrics, "gravity", parameters.gravity);
  add_joints(metrics, "inertia", parameters.inertia);
  add_joints(metrics, "friction", parameters.friction);
  metrics["parameters_covered"] = {parameters.covered, parameters.intervals};
  metrics.update(score_estimator(seen, trials));
  return method;
}

/// A method of the papers: a tip force from each recording by itself.
template <typename Result>
Row judge_baseline(const std::string& name, const MachineDescription& machine, const Result& result,
                   const identify::CommissionRuns& runs, const Trials& trials) {
  cli::check_interrupt();
  Row method = method_row(name);
  if (!take(result.summary, method)) return method;
  const auto compare = [&](const motion::MachineRecording& run) {
    return estimation::compare_torque(result, machine, run.recording);
  };
  (void)judge_torque(compare(runs.validation_slow), compare(runs.validation_digging), {}, method);
  const auto force = [&](const motion::MachineRecording& run) {
    return estimation::external_force(result, machine, run.recording);
  };
  method["metrics"].update(score_series(trials, {force(trials.slow), force(trials.digging), force(trials.pulls)}));
  return method;
}

/// What malaguti had: 40 s at 100 Hz of manual-like motion; here the first of the fast excitation.
estimation::Recording paper_recording(const estimation::Recording& fast) {
  estimation::Recording recording = estimation::decimated(fast, kMalagutiEvery);
  const auto length = static_cast<std::size_t>(kMalaguti_s / recording.step_s);
  if (recording.samples.size() > length) {
    recording.samples.resize(length);
    recording.usable.resize(length);
    recording.valve.resize(std::min(recording.valve.size(), length));
  }
  return recording;
}

void judge_baselines(const BatterySetup& setup, const identify::Commissioned& found,
                     const identify::CommissionRuns& runs, const Trials& trials, double hull_pitch_rad, Row& methods) {
  const std::array recordings{runs.slow.recording, runs.fast.recording};
  const estimation::FullResult unsurveyed =
      estimation::identify_full(setup.nominal, recordings, setup.full_nominal_pins);
  methods.push_back(
      judge_full(kFullNominalPins, setup.nominal, setup.full_nominal_pins, unsurveyed, runs, trials, hull_pitch_rad));

  const MachineDescription seen = calibrated(found.machine);
  methods.push_back(judge_baseline(
      "malaguti", seen, estimation::identify_malaguti(seen, std::array{paper_recording(runs.fast.recording)}), runs,
      trials));
  methods.push_back(
      judge_baseline("kim", seen, estimation::identify_kim(seen, std::span(recordings).first(1)), runs, trials));

  methods.push_back(method_row(kUncalibrated));
  methods.back()["metrics"] = score_estimator(setup.nominal, trials);
}

/// The same machine with finer wire encoders: only what they limit is judged.
Row judge_fine_encoders(const BatterySetup& setup, const MachineDescription& known, const sim::MachineTruth& today,
                        std::uint64_t seed) {
  constexpr double kFine_m = 3e-5;
  MachineDescription machine = known;
  machine.sensors.encoder_step_m = kFine_m;
  sim::MachineTruth truth = today;
  truth.machine.sensors.encoder_step_m = kFine_m;
  const MachineDescription seen = calibrated(machine);
  motion::MachineRun run(seen, truth, {}, middle_of_range(machine), seed);
  run.watch(watch_for_interrupt);
  TrialPlan plan = setup.trials;
  plan.presses = plan.lifts = 0;
  plan.hull = today.hull;
  Row method = method_row(kFullFineEncoders);
  method["metrics"] = score_estimator(seen, run_trials(run, seen, plan, seed));
  return method;
}

void judge_running(const PullPlan& plan, const MachineDescription& seen, const sim::MachineTruth& today,
                   std::uint64_t seed, Row& methods) {
  for (std::size_t i = 0; i < kContactModelNames.size(); ++i) {
    methods.push_back(method_row(kContactModelNames[i]));
    methods.back()["metrics"] = score_running(seen, today, static_cast<ContactModel>(i), plan, seed);
  }
}

/// Adds to what is there of its row.
void judge(const BatterySetup& setup, const sim::MachineTruth& truth, std::uint64_t seed, Row& row) {
  const identify::CommissionRuns runs =
      identify::run_commissioning(setup.nominal, truth, setup.commission, seed, watch_for_interrupt);
  const identify::Commissioned found = identify::calibrate(setup.nominal, runs, {true, setup.full});
  if (!found.full.summary.usable) throw InputError(found.full.summary.reasons.front());
  row["commissioning"] = score_commissioning(setup.nominal, found, truth);
  const sim::MachineTruth today = setup.oil_changes ? sim::another_day(truth, setup.family, seed) : truth;
  const MachineDescription seen = calibrated(found.machine);
  if (setup.running) {
    judge_running(*setup.running, seen, today, seed, row["methods"]);
    return;
  }
  motion::MachineRun run(seen, today, {}, middle_of_range(setup.nominal), stream_seed(seed, Stream::kUse));
  run.watch(watch_for_interrupt);
  TrialPlan plan = setup.trials;
  plan.hull = today.hull;
  const Trials trials = run_trials(run, seen, plan, seed);
  const double pitch = truth.hull_pitch_rad;
  Row& methods = row["methods"];
  methods.push_back(judge_full(kFull, found.machine, setup.full, found.full, runs, trials, pitch));
  for (const FullVariant& variant : setup.variants) {
    const std::array recordings{runs.slow.recording, runs.fast.recording};
    const estimation::FullResult full = estimation::identify_full(seen, recordings, variant.options);
    methods.push_back(judge_full(variant.method, found.machine, variant.options, full, runs, trials, pitch));
  }
  if (!setup.baselines) return;
  judge_baselines(setup, found, runs, trials, pitch, methods);
  methods.push_back(judge_fine_encoders(setup, found.machine, today, stream_seed(seed, Stream::kFine)));
}

bool is_metric(const Row& value) {
  return value.is_number() || value.is_null() ||
         (value.is_structured() && std::all_of(value.begin(), value.end(), is_metric));
}

bool has_metrics(const Row& part, const char* name) {
  return part.contains(name) && part[name].is_object() && is_metric(part[name]);
}

}  // namespace

Row judge_machine(const BatterySetup& setup, const sim::MachineTruth& truth, std::uint64_t seed) {
  Row row;
  row["seed"] = seed;
  try {
    judge(setup, truth, seed, row);
  } catch (const cli::Interrupted&) {
    throw;
  } catch (const std::exception& error) {
    return {{"seed", seed}, {"failure", error.what()}};
  }
  return row;
}

bool is_judged_machine(const Row& row) {
  if (!row.contains("seed") || !row["seed"].is_number_unsigned()) return false;
  if (row.contains("failure")) return row["failure"].is_string();
  if (!has_metrics(row, "commissioning") || !row.contains("methods") || !row["methods"].is_array()) return false;
  return std::all_of(row["methods"].begin(), row["methods"].end(), [](const Row& method) {
    return method.is_object() && method.contains("method") && method["method"].is_string() &&
           method.contains("identified") && method["identified"].is_boolean() && method.contains("usable") &&
           method["usable"].is_boolean() && has_metrics(method, "metrics");
  });
}

}  // namespace knuckle::studies
