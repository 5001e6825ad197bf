#include "app/identify/baseline_runs.h"

#include <cmath>
#include <numbers>
#include <random>

#include "app/identify/commission.h"
#include "core/error.h"
#include "estimation/identification/least_squares.h"
#include "estimation/identification/malaguti.h"
#include "estimation/identification/paper_motions.h"
#include "machine/kinematics.h"
#include "machine/pose.h"

namespace knuckle::identify {
namespace {

using estimation::BaseParameters;
using estimation::kInertia;
using estimation::kMomentX;
using estimation::kMomentZ;
using estimation::MalagutiOptions;
using estimation::Recording;

constexpr double kDegPerRad = 180 / std::numbers::pi;
constexpr int kPoses = 170;  // some are lost near end stops or do not come to rest
constexpr int kVerifyingPoses = 40;
constexpr double kRest_s = 0.8;

/// Rod lengths as they really were, with normal errors of noise_m; all else as recorded.
Recording with_exact_rods(const motion::MachineRecording& run, const sim::MachineTruth& truth, double noise_m,
                          std::uint64_t seed) {
  const Kinematics kinematics(truth.machine);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, noise_m > 0 ? noise_m : 1);
  Recording recording = run.recording;
  for (std::size_t i = 0; i < recording.samples.size(); ++i) {
    for (int joint = 0; joint < kJoints; ++joint) {
      const double exact_m = kinematics.cylinder_at(joint, run.truth[i].joint_rad[joint])->length_m;
      recording.samples[i].cylinder_m[joint] = exact_m + (noise_m > 0 ? noise(random) : 0);
    }
  }
  return recording;
}

void add(InertiaBias& row, const MachineDescription& machine, const Recording& recording,
         const MalagutiOptions& options, const std::map<std::string, double>& truth) {
  const estimation::MalagutiResult result = estimation::identify_malaguti(machine, std::span(&recording, 1), options);
  row.bucket.push_back(result.parameters[0] / truth.at("phi_D1"));
  row.stick.push_back(result.parameters[1] / truth.at("phi_D2"));
  for (const estimation::IdentifiedParameter& p : result.summary.parameters) {
    if (p.name.starts_with("phi_f")) continue;
    ++row.intervals;
    row.covered += std::abs(p.value - truth.at(p.name)) <= 1.96 * p.sigma ? 1 : 0;
  }
}

}  // namespace

BaselineRuns run_baseline(const std::string& method, const MachineDescription& machine, motion::MachineRun& run,
                          std::uint64_t seed) {
  BaselineRuns runs;
  if (method == "static") {
    runs.identification.push_back(run.stops(estimation::static_poses(machine, kPoses, seed), kRest_s));
    runs.verification.push_back(run.stops(estimation::static_poses(machine, kVerifyingPoses, seed + 1000), kRest_s));
  } else if (method == "malaguti") {
    runs.identification.push_back(run.follow(estimation::malaguti_dig_like_motion(machine, seed)));
    runs.verification.push_back(run.follow(estimation::malaguti_dig_like_motion(machine, seed + 1000)));
  } else if (method == "kim") {
    runs.identification.push_back(run.follow(estimation::kim_slow_motion(machine)));
    runs.verification.push_back(run.follow(estimation::kim_verification_1(machine)));
    runs.verification.push_back(run.follow(estimation::kim_verification_2(machine)));
  } else {
    throw InputError("--method " + method + ": not one of static, malaguti, kim");
  }
  return runs;
}

std::vector<Recording> recordings(const std::vector<motion::MachineRecording>& runs) {
  std::vector<Recording> plain;
  for (const motion::MachineRecording& run : runs) plain.push_back(run.recording);
  return plain;
}

BaseParameters projected_parameters(const sim::MachineTruth& truth, std::span<const motion::MachineRecording> runs) {
  constexpr std::size_t kEvery = 5;
  const estimation::RigidArm arm(truth.machine);
  std::vector<motion::TruthSample> samples;
  for (const motion::MachineRecording& run : runs) {
    for (std::size_t i = 0; i < run.truth.size(); i += kEvery) samples.push_back(run.truth[i]);
  }
  const auto rows = static_cast<Eigen::Index>(kJoints * samples.size());
  estimation::LeastSquaresProblem problem;
  problem.columns.resize(rows, estimation::kBaseParameters);
  problem.right.resize(rows);
  problem.weight = Eigen::VectorXd::Ones(rows);
  Eigen::Index at = 0;
  for (const motion::TruthSample& s : samples) {
    const JointVector torque = s.lever_m.cwiseProduct(s.cylinder_N - s.friction_N);
    problem.columns.middleRows<kJoints>(at) =
        arm.inverse_dynamics(estimation::Pose(s.joint_rad, truth.hull_pitch_rad), estimation::absolute(s.joint_radps),
                             estimation::absolute(s.joint_radps2));
    problem.right.segment<kJoints>(at) << torque[0] - torque[1], torque[1] - torque[2], torque[2];
    at += kJoints;
  }
  return estimation::solve_least_squares(problem).parameters;
}

std::map<std::string, double> baseline_truth(const std::string& method, const MachineDescription& machine,
                                             const sim::MachineTruth& truth, const BaselineRuns& runs) {
  const BaseParameters base =
      projected_parameters(truth, runs.verification.empty() ? runs.identification : runs.verification);
  std::map<std::string, double> values;
  if (method == "kim") {
    const double m3 = machine.links[kBucket].mass_kg, m2 = machine.links[kArm].mass_kg;
    const JointVector later(machine.links[kBoom].length_m * (m2 + m3), machine.links[kArm].length_m * m3, 0);
    for (int i = 0; i < kJoints; ++i) {
      const std::string n = std::to_string(i + 1);
      const PlanarVector own(base[kMomentX + i] - later[i], base[kMomentZ + i]);
      values["m" + n + " L_O" + n + "G" + n] = own.norm();
      values["A_mc" + n] = std::atan2(own.y(), own.x()) * kDegPerRad;
    }
    return values;
  }
  const bool still = method == "static";
  for (int i = kBucket, s = 1; i >= (still ? kBoom : kArm); --i, s += 2) {
    values[(still ? "S" : "phi_S") + std::to_string(s)] = base[kMomentX + i];
    values[(still ? "S" : "phi_S") + std::to_string(s + 1)] = base[kMomentZ + i];
  }
  if (still) return values;
  values["phi_D1"] = base[kInertia + kBucket];
  values["phi_D2"] = base[kInertia + kArm];
  for (const auto& [joint, first] : {std::pair{kBucket, 1}, std::pair{kArm, 3}}) {
    const sim::LuGreFriction& friction = truth.friction[static_cast<std::size_t>(joint)];
    values["phi_f" + std::to_string(first)] = (friction.coulomb_extend_N + friction.coulomb_retract_N) / 2;
    values["phi_f" + std::to_string(first + 1)] = friction.viscous_Ns_per_m * truth.viscosity_factor;
  }
  return values;
}

std::vector<InertiaBias> malaguti_bias(const MachineDescription& machine, std::uint64_t first_seed, int machines,
                                       const std::function<void(double)>& progress) {
  constexpr double kNoise_m = 1e-4;
  std::vector<InertiaBias> rows{{"the authors' settings, sensors as they are", {}, {}},
                                {"the same on exact rod lengths", {}, {}},
                                {"the same on exact rod lengths with 0.1 mm of white noise", {}, {}},
                                {"2 Hz filter and 41-sample cubic, sensors as they are", {}, {}}};
  for (int i = 0; i < machines; ++i) {
    if (progress) progress(static_cast<double>(i) / machines);
    const std::uint64_t seed = first_seed + static_cast<std::uint64_t>(i);
    const sim::MachineTruth truth = sim::sample_truth(machine, seed);
    motion::MachineRun run(machine, truth, {}, middle_of_range(machine), seed);
    const motion::MachineRecording made = run.follow(estimation::malaguti_dig_like_motion(machine, seed));
    const auto values = baseline_truth("malaguti", machine, truth, {{made}, {}});
    add(rows[0], machine, made.recording, {}, values);
    add(rows[1], machine, with_exact_rods(made, truth, 0, seed), {}, values);
    add(rows[2], machine, with_exact_rods(made, truth, kNoise_m, seed), {}, values);
    add(rows[3], machine, made.recording, estimation::repaired_malaguti_options(), values);
  }
  return rows;
}

}  // namespace knuckle::identify
