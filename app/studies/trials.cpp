#include "app/studies/trials.h"

#include <cmath>
#include <numbers>
#include <random>

#include "app/motion/path_builder.h"
#include "core/seed.h"
#include "estimation/identification/excitation.h"
#include "estimation/regressor.h"
#include "machine/kinematics.h"
#include "sim/hull.h"

namespace knuckle::studies {
namespace {

constexpr double kHold_s = 2.0, kRamp_s = 0.5, kJudge_s = 0.5, kRest_s = 1.0;
constexpr double kKnock_N = 500, kKnock_s = 0.4;
constexpr double kCreep_mps = 0.015;     // of the fastest cylinder
constexpr double kTransfer_mps = 0.03;   // likewise, between presses
constexpr double kStrongest_Pa = 160e5;  // a pull that needs more would open the relief valves
constexpr double kLeastPush = 0.1;       // of the machine's weight that either end of the tracks must bear

class Sampler {
 public:
  explicit Sampler(std::uint64_t seed) : generator_(seed) {}
  double within(double low, double high) { return std::uniform_real_distribution<double>(low, high)(generator_); }

 private:
  std::mt19937_64 generator_;
};

/// Poses and loads that the machine can hold.
class Rig {
 public:
  Rig(const MachineDescription& machine, const sim::HullTruth& hull, double step_s, std::uint64_t seed)
      : machine_(machine),
        hull_(hull),
        kinematics_(machine),
        weight_(estimation::lumped_parameters(machine)),
        step_s_(step_s),
        sampler_(seed) {}

  [[nodiscard]] motion::PathBuilder start() { return {pose(), step_s_}; }

  /// Inside the working range, away from its ends and from the straight arm.
  JointVector pose() {
    JointVector q;
    for (int i = 0; i < kJoints; ++i) {
      const LinkDescription& link = machine_.links[static_cast<std::size_t>(i)];
      const double room = 0.15 * (link.max_rad - link.min_rad);
      q[i] = sampler_.within(link.min_rad + room, link.max_rad - room);
    }
    return q;
  }

  /// Time for a move at this speed of the fastest cylinder.
  [[nodiscard]] double duration_s(const JointVector& from, const JointVector& to, double cylinder_mps) const {
    double furthest = 0;
    for (int i = 0; i < kJoints; ++i) {
      furthest = std::max(furthest, std::abs(kinematics_.cylinder_at(i, to[i])->length_m -
                                             kinematics_.cylinder_at(i, from[i])->length_m));
    }
    return std::max(0.5, motion::PathBuilder::kPeak * furthest / cylinder_mps);
  }

  /// A pull of 1-5 kN anywhere that this pose can hold.
  PlanarVector pull(const JointVector& pose_rad) {
    for (;;) {
      const double size = sampler_.within(1000, 5000), angle = sampler_.within(0, 2 * std::numbers::pi);
      const PlanarVector force = size * PlanarVector(std::cos(angle), std::sin(angle));
      if (holds(pose_rad, force)) return force;
    }
  }
  PlanarVector knock() {
    const double angle = sampler_.within(0, 2 * std::numbers::pi);
    return kKnock_N * PlanarVector(std::cos(angle), std::sin(angle));
  }
  [[nodiscard]] Sampler& sampler() noexcept { return sampler_; }
  [[nodiscard]] double step_s() const noexcept { return step_s_; }

 private:
  [[nodiscard]] bool holds(const JointVector& q, const PlanarVector& force) const {
    const estimation::Pose at(q, 0);
    const JointVector torque = estimation::joint_torque(estimation::RigidArm::gravity(at) * weight_) -
                               kinematics_.tip_jacobian(q).transpose() * force;
    for (int i = 0; i < kJoints; ++i) {
      const CylinderDescription& cylinder = machine_.cylinders[static_cast<std::size_t>(i)];
      const double needed_N = torque[i] / kinematics_.cylinder_at(i, q[i])->lever_m;
      if (needed_N > kStrongest_Pa * cylinder.head_area_m2() || -needed_N > kStrongest_Pa * cylinder.rod_side_area_m2())
        return false;
    }
    return hull_.stiffness_N_per_m == 0 || stands(torque[kBoom], force);
  }
  /// @param boom_Nm what the boom's joint holds. Moments about the tracks' middle, positive where they lift the front.
  [[nodiscard]] bool stands(double boom_Nm, const PlanarVector& force) const {
    double arm_kg = 0;
    for (const LinkDescription& link : machine_.links) arm_kg += link.mass_kg;
    for (const CylinderDescription& c : machine_.cylinders) arm_kg += c.body_mass_kg + c.rod_mass_kg;
    const PlanarVector pin_m = -hull_.centre_m;
    const PlanarVector on_pin_N = force - PlanarVector(0, arm_kg * estimation::kGravity_mps2);
    const double lift_Nm = pin_m.x() * on_pin_N.y() - pin_m.y() * on_pin_N.x() - boom_Nm -
                           hull_.com_m.x() * hull_.mass_kg * estimation::kGravity_mps2;
    const double weight_N = (hull_.mass_kg + arm_kg) * estimation::kGravity_mps2;
    const auto [rear_N, front_N] = sim::pushes_at_rest_N(hull_, weight_N - force.y(), -lift_Nm);
    return std::min(rear_N, front_N) > kLeastPush * weight_N;
  }

  MachineDescription machine_;
  sim::HullTruth hull_;
  Kinematics kinematics_;
  estimation::BaseParameters weight_;
  double step_s_;
  Sampler sampler_;
};

/// Writes force into the samples from `at` on: ramp, hold, ramp.
void add_pull(std::vector<PlanarVector>& pull_N, std::size_t at, double step_s, const PlanarVector& force_N) {
  const double duration = 2 * kRamp_s + kHold_s;
  const auto n = static_cast<std::size_t>(std::lround(duration / step_s));
  for (std::size_t i = 0; i < n && at + i < pull_N.size(); ++i) {
    const double t = static_cast<double>(i) * step_s;
    const double share = std::clamp(std::min(t, duration - t) / kRamp_s, 0.0, 1.0);
    pull_N[at + i] = share * force_N;
  }
}

void run_presses(motion::MachineRun& run, Rig& rig, const TrialPlan& plan, Trials& trials) {
  motion::PathBuilder builder = rig.start();
  std::vector<std::size_t> starts;
  for (int k = 0; k < plan.presses; ++k) {
    const JointVector pose = rig.pose();
    builder.move(pose, rig.duration_s(builder.at(), pose, kTransfer_mps));
    builder.hold(kRest_s);
    starts.push_back(builder.size());
    Press press;
    press.force_N = rig.pull(pose);
    press.creeping = k % 2 == 1;
    const double length = 2 * kRamp_s + kHold_s;
    if (press.creeping) {
      // Some way towards another pose, at a creep.
      const JointVector towards = rig.pose();
      const double whole_s = rig.duration_s(pose, towards, kCreep_mps);
      builder.move(pose + std::min(1.0, length / whole_s) * (towards - pose), length);
    } else {
      builder.hold(length);
    }
    press.judge_to = starts.back() + static_cast<std::size_t>((kRamp_s + kHold_s) / rig.step_s());
    press.judge_from = press.judge_to - static_cast<std::size_t>(kJudge_s / rig.step_s());
    builder.hold(kRest_s);
    trials.presses.push_back(press);
  }
  std::vector<PlanarVector> pull_N(builder.size(), PlanarVector::Zero());
  for (std::size_t k = 0; k < starts.size(); ++k) add_pull(pull_N, starts[k], rig.step_s(), trials.presses[k].force_N);
  trials.pulls = run.follow(builder.path(), pull_N, plan.from_tip_m);
}

/// Steps in the midst of slow moves, between two of which the contact has time to be forgotten.
void run_knocks(motion::MachineRun& run, Rig& rig, const TrialPlan& plan, Trials& trials) {
  constexpr double kMove_s = 4;
  motion::PathBuilder builder = rig.start();
  std::vector<PlanarVector> force;
  for (int k = 0; k < plan.knocks; ++k) {
    const JointVector towards = rig.pose();
    const double whole_s = rig.duration_s(builder.at(), towards, kTransfer_mps);
    trials.knock_at.push_back(builder.size() + static_cast<std::size_t>(rig.sampler().within(1.6, 2.4) / rig.step_s()));
    builder.move(builder.at() + std::min(1.0, kMove_s / whole_s) * (towards - builder.at()), kMove_s);
    builder.hold(kRest_s);
    force.push_back(rig.knock());
  }
  std::vector<PlanarVector> pull_N(builder.size(), PlanarVector::Zero());
  for (std::size_t k = 0; k < force.size(); ++k) {
    const auto n = static_cast<std::size_t>(kKnock_s / rig.step_s());
    std::fill_n(pull_N.begin() + static_cast<std::ptrdiff_t>(trials.knock_at[k]), n, force[k]);
  }
  trials.knocks = run.follow(builder.path(), pull_N, plan.from_tip_m);
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
