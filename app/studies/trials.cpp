#include "app/studies/trials.h"

#include <cmath>
#include <numbers>
#include <optional>

#include "app/motion/path_builder.h"
#include "core/seed.h"
#include "estimation/identification/excitation.h"

namespace knuckle::studies {
namespace {

constexpr double kRest_s = 1.0;
constexpr double kKnock_N = 500, kKnock_s = 0.4;
constexpr double kTransfer_mps = 0.03;  // of the fastest cylinder, between presses

void run_presses(motion::MachineRun& run, Rig& rig, const TrialPlan& plan, Trials& trials) {
  PullPath path(rig.pose(), rig.step_s());
  for (int k = 0; k < plan.presses; ++k) {
    const JointVector pose = rig.pose();
    path.go_to(pose, rig.duration_s(path.at(), pose, kTransfer_mps));
    const PlanarVector force_N = rig.pull(pose);
    path.pull(force_N, k % 2 == 1 ? std::optional(rig.crept(pose, rig.pose())) : std::nullopt);
  }
  trials.presses = path.presses();
  trials.pulls = run.follow(path.path(), path.pull_N(), {-plan.from_tip_m, 0});
}

/// Steps in the midst of slow moves, between two of which the contact has time to be forgotten.
void run_knocks(motion::MachineRun& run, Rig& rig, const TrialPlan& plan, Trials& trials) {
  constexpr double kMove_s = 4;
  motion::PathBuilder builder(rig.pose(), rig.step_s());
  std::vector<PlanarVector> force;
  for (int k = 0; k < plan.knocks; ++k) {
    const JointVector towards = rig.pose();
    const double whole_s = rig.duration_s(builder.at(), towards, kTransfer_mps);
    trials.knock_at.push_back(builder.size() + static_cast<std::size_t>(rig.sampler().within(1.6, 2.4) / rig.step_s()));
    builder.move(builder.at() + std::min(1.0, kMove_s / whole_s) * (towards - builder.at()), kMove_s);
    builder.hold(kRest_s);
    const double angle = rig.sampler().within(0, 2 * std::numbers::pi);
    force.push_back(kKnock_N * PlanarVector(std::cos(angle), std::sin(angle)));
  }
  std::vector<PlanarVector> pull_N(builder.size(), PlanarVector::Zero());
  for (std::size_t k = 0; k < force.size(); ++k) {
    const auto n = static_cast<std::size_t>(kKnock_s / rig.step_s());
    std::fill_n(pull_N.begin() + static_cast<std::ptrdiff_t>(trials.knock_at[k]), n, force[k]);
  }
  trials.knocks = run.follow(builder.path(), pull_N, {-plan.from_tip_m, 0});
}

/// Boom and arm up and down with the bucket held where it carries.
Lift lift(motion::MachineRun& run, const MachineDescription& machine, double step_s, double mass_kg) {
  constexpr double kUp_s = 5;
  JointVector low, high;
  for (int i = 0; i < kJoints; ++i) {
    const LinkDescription& link = machine.links[static_cast<std::size_t>(i)];
    low[i] = link.min_rad + 0.35 * (link.max_rad - link.min_rad);
    high[i] = link.min_rad + 0.6 * (link.max_rad - link.min_rad);
  }
  high[kBucket] = low[kBucket] + 0.2;
  motion::PathBuilder builder(low, step_s);
  builder.hold(kRest_s);
  builder.move(high, kUp_s);
  builder.hold(0.5);
  builder.move(low, kUp_s);
  builder.hold(0.5);
  run.hang(mass_kg);
  return {run.follow(builder.path()), mass_kg};
}

}  // namespace

Trials run_trials(motion::MachineRun& run, const MachineDescription& machine, const TrialPlan& plan,
                  std::uint64_t seed) {
  Trials trials;
  const double step_s = 1 / machine.bus.sync_Hz;
  Rig rig(machine, plan.hull, step_s, stream_seed(seed, Stream::kLoads));
  trials.warm_up = run.follow(
      estimation::held_out_motion(machine, stream_seed(seed, Stream::kWarmUp), estimation::MotionSpeed::kDigging, 20));
  trials.slow = run.follow(estimation::held_out_motion(machine, stream_seed(seed, Stream::kSlow),
                                                       estimation::MotionSpeed::kSlow, plan.slow_s));
  trials.digging = run.follow(estimation::held_out_motion(machine, stream_seed(seed, Stream::kDigging),
                                                          estimation::MotionSpeed::kDigging, plan.digging_s));
  run_presses(run, rig, plan, trials);
  run_knocks(run, rig, plan, trials);
  trials.empty = lift(run, machine, step_s, 0);
  for (int k = 0; k < plan.lifts; ++k) {
    trials.lifts.push_back(lift(run, machine, step_s, rig.sampler().within(0.15, 1) * machine.payload_full_scale_kg));
  }
  run.hang(0);
  return trials;
}

}  // namespace knuckle::studies
