#include "app/identify/commission.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <optional>
#include <random>

#include "core/seed.h"
#include "core/units.h"
#include "estimation/identification/excitation.h"
#include "machine/kinematics.h"

namespace knuckle::identify {
namespace {

/// Where the surveyor takes the machine's axes to be: one error of all points together.
class SurveyFrame {
 public:
  SurveyFrame(const CommissionPlan& plan, std::uint64_t seed) {
    std::mt19937_64 random(stream_seed(seed, Stream::kSurveyFrame));
    const auto within = [&random](double bound) { return bound * (2 * unit_interval(random) - 1); };
    turn_ = Eigen::Rotation2Dd(within(plan.survey_frame_rad));
    const double dx = within(plan.survey_frame_m), dz = within(plan.survey_frame_m);
    shift_m_ = PlanarVector(dx, dz);
  }
  void apply(estimation::Survey& survey) const {
    for (estimation::SurveyPose& pose : survey.poses) {
      for (PlanarVector* point : {&pose.arm_pin_m, &pose.bucket_pin_m, &pose.tip_m}) *point = turn_ * *point + shift_m_;
    }
  }

 private:
  Eigen::Rotation2Dd turn_;
  PlanarVector shift_m_;
};

estimation::Survey survey(motion::MachineRun& run, const std::vector<JointVector>& poses_rad, double sigma_m,
                          const SurveyFrame& frame, const std::function<void(const estimation::Survey&)>& posed) {
  estimation::Survey all;
  for (const JointVector& pose_rad : poses_rad) {
    estimation::Survey one = run.survey({pose_rad}, sigma_m);
    frame.apply(one);
    if (all.poses.empty()) {
      all = std::move(one);
    } else {
      all.poses.push_back(one.poses.front());
    }
    if (posed) posed(all);
  }
  return all;
}

bool curved(const estimation::ValveResult& result) {
  return std::any_of(result.valves.begin(), result.valves.end(),
                     [](const ValveCalibration& valve) { return !valve.straight(); });
}

}  // namespace

void set_surveyor(sim::Family family, CommissionPlan& plan) {
  if (family == sim::Family::kSmooth) return;
  const bool worn = family == sim::Family::kWorn;
  plan.survey_frame_rad = (worn ? 0.2 : 0.05) * kDegree;
  plan.survey_frame_m = worn ? 3e-3 : 1e-3;
}

CommissionRuns run_commissioning(const MachineDescription& nominal, const sim::MachineTruth& truth,
                                 const CommissionPlan& plan, std::uint64_t seed,
                                 const std::function<void(double)>& progress,
                                 const std::function<void(const estimation::Survey&)>& posed) {
  using estimation::MotionSpeed;
  MachineDescription machine = calibrated(nominal);
  std::optional<motion::MachineRun> run;
  const auto start = [&] {
    run.emplace(machine, truth, sim::WorldDescription{}, middle_of_range(machine),
                stream_seed(seed, Stream::kSensorNoise));
    if (progress) run->watch([&](double elapsed_s) { progress(std::min(1.0, elapsed_s / plan.duration_s())); });
  };
  start();
  const auto held_out = [&](std::uint64_t own, MotionSpeed speed) {
    return run->follow(estimation::held_out_motion(machine, own, speed, plan.validation_s));
  };
  CommissionRuns runs;
  if (plan.survey_poses > 0)
    runs.survey = survey(*run, estimation::survey_poses(machine, plan.survey_poses), plan.survey_sigma_m,
                         SurveyFrame(plan, seed), posed);
  runs.slow = run->follow(estimation::slow_sweeps(machine, plan.slow_s));
  if (curved(learn_valves(machine, std::span(&runs.slow.recording, 1)))) {
    // Behind valves that are not as drawn the machine has hardly followed: once more with what they are.
    machine = calibrated(machine);
    start();
    runs.slow = run->follow(estimation::slow_sweeps(machine, plan.slow_s));
  }
  runs.fast = run->follow(estimation::fast_excitation(machine, plan.fast_s, stream_seed(seed, Stream::kExcitation)));
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
  for (std::size_t joint = 0; joint < kJoints; ++joint) {
    if (result.axes[joint].usable) machine.valve_calibration[joint] = result.valves[joint];
  }
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
