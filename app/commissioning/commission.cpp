#include "app/commissioning/commission.h"

#include <array>

#include "estimation/identification/excitation.h"

namespace knuckle::app {

JointVector middle_of_range(const MachineDescription& machine) noexcept {
  JointVector middle;
  for (int i = 0; i < kJoints; ++i) {
    const LinkDescription& link = machine.links[static_cast<std::size_t>(i)];
    middle[i] = 0.5 * (link.min_rad + link.max_rad);
  }
  return middle;
}

CommissionRuns run_commissioning(const MachineDescription& machine, const sim::MachineTruth& truth,
                                 const CommissionPlan& plan, std::uint64_t seed,
                                 const std::function<void(double)>& progress) {
  const auto done = [&](double share) {
    if (progress) progress(share);
  };
  MachineRun run(calibrated(machine), truth, {}, middle_of_range(machine), seed);
  CommissionRuns runs;
  done(0);
  if (plan.survey_poses > 0) {
    runs.survey = run.survey(estimation::survey_poses(machine, plan.survey_poses), plan.survey_sigma_m);
  }
  done(0.3);
  runs.slow = run.follow(estimation::slow_sweeps(machine, plan.slow_s));
  done(0.6);
  runs.fast = run.follow(estimation::fast_excitation(machine, plan.fast_s, seed));
  done(0.8);
  using estimation::MotionSpeed;
  runs.validation_slow =
      run.follow(estimation::held_out_motion(machine, seed + 100, MotionSpeed::kSlow, plan.validation_s));
  runs.validation_digging =
      run.follow(estimation::held_out_motion(machine, seed + 101, MotionSpeed::kDigging, plan.validation_s));
  done(1);
  return runs;
}

Commissioned calibrate(const MachineDescription& drawing, const CommissionRuns& runs,
                       const CommissionOptions& options) {
  Commissioned result;
  result.machine = drawing;
  if (options.calibrate_geometry) {
    result.geometry = estimation::calibrate_geometry(drawing, runs.survey, {});
    if (result.geometry.summary.usable) result.machine.geometry_calibration = result.geometry.geometry;
  }
  const std::array recordings{runs.slow.recording, runs.fast.recording};
  result.valves = estimation::identify_valves(calibrated(result.machine), recordings);
  result.machine.valve_calibration = result.valves.valves;
  result.full = estimation::identify_full(calibrated(result.machine), recordings, options.full);
  if (result.full.summary.usable) result.machine.dynamics_calibration = result.full.dynamics;
  return result;
}

}  // namespace knuckle::app
