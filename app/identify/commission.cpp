#include "app/identify/commission.h"

#include <algorithm>
#include <array>

#include "core/seed.h"
#include "estimation/identification/excitation.h"
#include "machine/pose.h"

namespace knuckle::identify {
namespace {

estimation::Survey survey(motion::MachineRun& run, const std::vector<JointVector>& poses_rad, double sigma_m,
                          const std::function<void(const estimation::Survey&)>& posed) {
  estimation::Survey all;
  for (const JointVector& pose_rad : poses_rad) {
    estimation::Survey one = run.survey({pose_rad}, sigma_m);
    if (all.poses.empty()) {
      all = std::move(one);
    } else {
      all.poses.push_back(one.poses.front());
    }
    if (posed) posed(all);
  }
  return all;
}

}  // namespace

CommissionRuns run_commissioning(const MachineDescription& nominal, const sim::MachineTruth& truth,
                                 const CommissionPlan& plan, std::uint64_t seed,
                                 const std::function<void(double)>& progress,
                                 const std::function<void(const estimation::Survey&)>& posed) {
  using estimation::MotionSpeed;
  const MachineDescription machine = calibrated(nominal);
  motion::MachineRun run(machine, truth, {}, middle_of_range(machine), stream_seed(seed, Stream::kSensorNoise));
  if (progress) run.watch([&](double elapsed_s) { progress(std::min(1.0, elapsed_s / plan.duration_s())); });
  const auto held_out = [&](std::uint64_t own, MotionSpeed speed) {
    return run.follow(estimation::held_out_motion(machine, own, speed, plan.validation_s));
  };
  CommissionRuns runs;
  if (plan.survey_poses > 0)
    runs.survey = survey(run, estimation::survey_poses(machine, plan.survey_poses), plan.survey_sigma_m, posed);
  runs.slow = run.follow(estimation::slow_sweeps(machine, plan.slow_s));
  runs.fast = run.follow(estimation::fast_excitation(machine, plan.fast_s, stream_seed(seed, Stream::kExcitation)));
  runs.validation_slow = held_out(stream_seed(seed, Stream::kValidation), MotionSpeed::kSlow);
  runs.validation_digging = held_out(stream_seed(seed, Stream::kValidation) + 1, MotionSpeed::kDigging);
  return runs;
}

estimation::GeometryResult learn_geometry(MachineDescription& machine, const estimation::Survey& survey) {
  estimation::GeometryResult result = estimation::calibrate_geometry(machine, survey);
  if (result.summary.usable) machine.geometry_calibration = result.geometry;
  return result;
}

estimation::ValveResult learn_valves(MachineDescription& machine, std::span<const estimation::Recording> recordings) {
  estimation::ValveResult result = estimation::identify_valves(calibrated(machine), recordings);
  const auto usable = [](const estimation::Identification& axis) { return axis.usable; };
  if (std::any_of(result.axes.begin(), result.axes.end(), usable)) machine.valve_calibration = result.valves;
  return result;
}

Commissioned calibrate(const MachineDescription& nominal, const CommissionRuns& runs,
                       const CommissionOptions& options) {
  Commissioned result;
  result.machine = nominal;
  if (options.calibrate_geometry) result.geometry = learn_geometry(result.machine, runs.survey);
  const std::array recordings{runs.slow.recording, runs.fast.recording};
  result.full = estimation::identify_full(calibrated(result.machine), recordings, options.full);
  if (result.full.summary.usable) result.machine.dynamics_calibration = result.full.dynamics;
  result.valves = learn_valves(result.machine, recordings);
  return result;
}

}  // namespace knuckle::identify
