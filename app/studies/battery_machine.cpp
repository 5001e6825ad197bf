#include "app/studies/battery_machine.h"

#include <array>
#include <limits>

#include "app/cli/interrupt.h"
#include "app/identify/held_out.h"
#include "core/seed.h"
#include "estimation/identification/kim.h"
#include "estimation/identification/malaguti.h"
#include "machine/pose.h"

namespace knuckle::studies {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kCompare_Hz = 2;
constexpr double kMalaguti_s = 40;         // what the paper recorded
constexpr std::size_t kMalagutiEvery = 2;  // 200 Hz to its 100 Hz

estimation::TorqueFit no_fit() {
  return {JointVector::Constant(kNaN), JointVector::Constant(kNaN), JointVector::Constant(kNaN)};
}

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

/// @return whether there is a result to judge.
bool take(const estimation::Identification& summary, MethodOutcome& outcome) {
  outcome.identified = summary.usable;
  if (!summary.usable) outcome.reason = summary.reasons.front();
  return summary.usable;
}

void judge_torque(const estimation::TorqueComparison& slow, const estimation::TorqueComparison& digging,
                  bool models_all, MethodOutcome& outcome) {
  const std::vector<std::string> against =
      identify::objections(std::array{identify::held_out("slow", outcome.method, slow),
                                      identify::held_out("digging", outcome.method, digging)},
                           models_all);
  outcome.usable = against.empty();
  if (!outcome.usable) outcome.reason = against.front();
  const estimation::TorqueComparison both = joined(slow, digging);
  outcome.torque_2Hz = estimation::torque_fit(both, kCompare_Hz);
  outcome.torque_raw = estimation::torque_fit(both, 0);
}

MethodOutcome judge_full(const std::string& method, const MachineDescription& machine,
                         const estimation::FullOptions& options, const estimation::FullResult& full,
                         const identify::CommissionRuns& runs, const Trials& trials, double hull_pitch_rad) {
  cli::check_interrupt();
  MethodOutcome outcome;
  outcome.method = method;
  if (!take(full.summary, outcome)) return outcome;
  MachineDescription seen = calibrated(machine);
  const auto compare = [&](const motion::MachineRecording& run) {
    return estimation::compare_torque(full.dynamics, seen, run.recording, options);
  };
  judge_torque(compare(runs.validation_slow), compare(runs.validation_digging), true, outcome);
  seen.dynamics_calibration = full.dynamics;
  seen.dynamics_calibration->residual_rms_Nm = outcome.torque_2Hz.rms_Nm;
  outcome.parameters = identify::score_parameters(seen, runs, full.dynamics, full.summary.covariance, hull_pitch_rad);
  outcome.force = score_estimator(seen, trials);
  return outcome;
}

/// A method of the papers: a tip force from each recording by itself.
template <typename Result>
MethodOutcome judge_baseline(const std::string& method, const MachineDescription& machine, const Result& result,
                             const identify::CommissionRuns& runs, const Trials& trials) {
  cli::check_interrupt();
  MethodOutcome outcome;
  outcome.method = method;
  if (!take(result.summary, outcome)) return outcome;
  const auto compare = [&](const motion::MachineRecording& run) {
    return estimation::compare_torque(result, machine, run.recording);
  };
  judge_torque(compare(runs.validation_slow), compare(runs.validation_digging), false, outcome);
  const auto force = [&](const motion::MachineRecording& run) {
    return estimation::external_force(result, machine, run.recording);
  };
  outcome.force = score_series(trials, {force(trials.slow), force(trials.digging), force(trials.pulls)});
  return outcome;
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
                     const identify::CommissionRuns& runs, const Trials& trials, double hull_pitch_rad,
                     MachineOutcome& outcome) {
  const std::array recordings{runs.slow.recording, runs.fast.recording};
  const estimation::FullResult unsurveyed =
      estimation::identify_full(setup.nominal, recordings, setup.full_nominal_pins);
  outcome.methods.push_back(
      judge_full(kFullNominalPins, setup.nominal, setup.full_nominal_pins, unsurveyed, runs, trials, hull_pitch_rad));

  const MachineDescription seen = calibrated(found.machine);
  outcome.methods.push_back(judge_baseline(
      "malaguti", seen, estimation::identify_malaguti(seen, std::array{paper_recording(runs.fast.recording)}), runs,
      trials));
  outcome.methods.push_back(
      judge_baseline("kim", seen, estimation::identify_kim(seen, std::span(recordings).first(1)), runs, trials));

  MethodOutcome nominal;
  nominal.method = kUncalibrated;
  nominal.identified = nominal.usable = true;
  nominal.torque_2Hz = nominal.torque_raw = no_fit();
  nominal.force = score_estimator(setup.nominal, trials);
  outcome.methods.push_back(nominal);
}

/// The same machine with finer wire encoders: only what they limit is judged.
MethodOutcome judge_fine_encoders(const BatterySetup& setup, const MachineDescription& known,
                                  const sim::MachineTruth& today, std::uint64_t seed) {
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
  MethodOutcome outcome;
  outcome.method = kFullFineEncoders;
  outcome.identified = outcome.usable = true;
  outcome.torque_2Hz = outcome.torque_raw = no_fit();
  outcome.force = score_estimator(seen, run_trials(run, seen, plan, seed));
  return outcome;
}

void judge(const BatterySetup& setup, const sim::MachineTruth& truth, std::uint64_t seed, MachineOutcome& outcome) {
  const identify::CommissionRuns runs =
      identify::run_commissioning(setup.nominal, truth, setup.commission, seed, watch_for_interrupt);
  const identify::Commissioned found = identify::calibrate(setup.nominal, runs, {true, setup.full});
  if (!found.full.summary.usable) {
    outcome.failure = found.full.summary.reasons.front();
    return;
  }
  outcome.commissioning = score_commissioning(setup.nominal, found, truth);
  const sim::MachineTruth today = setup.oil_changes ? sim::another_day(truth, setup.family, seed) : truth;
  const MachineDescription seen = calibrated(found.machine);
  motion::MachineRun run(seen, today, {}, middle_of_range(setup.nominal), stream_seed(seed, Stream::kUse));
  run.watch(watch_for_interrupt);
  TrialPlan plan = setup.trials;
  plan.hull = today.hull;
  const Trials trials = run_trials(run, seen, plan, seed);
  const double pitch = truth.hull_pitch_rad;
  outcome.methods.push_back(judge_full(kFull, found.machine, setup.full, found.full, runs, trials, pitch));
  for (const FullVariant& variant : setup.variants) {
    const std::array recordings{runs.slow.recording, runs.fast.recording};
    const estimation::FullResult full = estimation::identify_full(seen, recordings, variant.options);
    outcome.methods.push_back(judge_full(variant.method, found.machine, variant.options, full, runs, trials, pitch));
  }
  if (!setup.baselines) return;
  judge_baselines(setup, found, runs, trials, pitch, outcome);
  outcome.methods.push_back(judge_fine_encoders(setup, found.machine, today, stream_seed(seed, Stream::kFine)));
}

}  // namespace

MachineOutcome judge_machine(const BatterySetup& setup, const sim::MachineTruth& truth, std::uint64_t seed) {
  MachineOutcome outcome;
  outcome.seed = seed;
  try {
    judge(setup, truth, seed, outcome);
  } catch (const cli::Interrupted&) {
    throw;
  } catch (const std::exception& error) {
    outcome.failure = error.what();
    outcome.methods.clear();
  }
  return outcome;
}

}  // namespace knuckle::studies
