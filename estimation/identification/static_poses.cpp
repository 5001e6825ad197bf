#include "estimation/identification/static_poses.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/units.h"
#include "estimation/identification/baseline.h"
#include "estimation/identification/least_squares.h"
#include "machine/description.h"
#include "machine/encoder_length.h"

namespace knuckle::estimation {
namespace {

constexpr double kStill_rad = 0.5 * kDegree;
constexpr double kLeastStill_m = 2e-4;

/// Long enough to average a pressure ripple, short enough to find short rests.
MotionOptions motion_options() {
  MotionOptions options;
  options.window_s = 0.07;
  options.order = 2;
  return options;
}

RestingPose mean_pose(const Motion& motion, const Stretch& stretch) {
  RestingPose pose{JointVector::Zero(), JointVector::Zero(), 0};
  for (Eigen::Index i = stretch.first; i < stretch.end; ++i) {
    pose.joint_rad += motion.joint_rad.col(i);
    pose.torque_Nm += cylinder_torque(motion, i);
    pose.hull_pitch_rad += motion.hull_pitch_rad[i];
  }
  const auto count = static_cast<double>(stretch.size());
  return {pose.joint_rad / count, pose.torque_Nm / count, pose.hull_pitch_rad / count};
}

bool near_stop(const MachineDescription& machine, const JointVector& cylinder_m, double margin_m) {
  for (int i = 0; i < kJoints; ++i) {
    const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(i)];
    if (cylinder_m[i] < cylinder.min_length_m + margin_m || cylinder_m[i] > cylinder.max_length_m - margin_m)
      return true;
  }
  return false;
}

/// Stretches inside `stretch` in which no rod moves by more than most_m.
std::vector<Stretch> rests(const Motion& motion, const Stretch& stretch, double most_m) {
  std::vector<Stretch> result;
  JointVector low, high;
  for (Eigen::Index i = stretch.first; i < stretch.end; ++i) {
    const JointVector length = motion.cylinder_m.col(i);
    if (i > stretch.first) {
      low = low.cwiseMin(length);
      high = high.cwiseMax(length);
    }
    if (i == stretch.first || (high - low).maxCoeff() > most_m) {
      result.push_back({i, i});
      low = high = length;
    }
    result.back().end = i + 1;
  }
  return result;
}

/// Rows in turn of bucket, stick (, boom); columns S1, S2, ...
LeastSquaresProblem balances(const std::vector<RestingPose>& poses, int first_link) {
  const int links = kJoints - first_link;
  const auto rows = static_cast<Eigen::Index>(poses.size()) * links;
  LeastSquaresProblem problem;
  problem.columns = Eigen::MatrixXd::Zero(rows, 2 * links);
  problem.right.resize(rows);
  problem.weight = Eigen::VectorXd::Ones(rows);
  Eigen::Index row = 0;
  for (const RestingPose& pose : poses) {
    const Regressor gravity = RigidArm::gravity(Pose(pose.joint_rad, pose.hull_pitch_rad));
    for (int n = 0; n < links; ++n, ++row) {
      const int link = kBucket - n;
      problem.columns.block<1, 2>(row, 2 * n) << gravity(link, kMomentX + link), gravity(link, kMomentZ + link);
      problem.right[row] = pose.torque_Nm[link] - (link == kBucket ? 0 : pose.torque_Nm[link + 1]);
      problem.group.push_back(n);
    }
  }
  return problem;
}

void fit_links(const std::vector<RestingPose>& poses, StaticResult& result) {
  Identification& summary = result.summary;
  const LeastSquaresSolution solution = solve_least_squares(balances(poses, result.first_link));
  std::vector<std::string> names;
  for (int n = 0; n < summary.columns; ++n) {
    names.push_back("S" + std::to_string(n + 1));
    summary.parameters.push_back(
        {names.back(), "kg m", solution.parameters[n], std::sqrt(solution.naive(n, n)), false});
    result.parameters[(n % 2 == 0 ? kMomentX : kMomentZ) + kBucket - n / 2] = solution.parameters[n];
  }
  summary.covariance = solution.naive;
  summary.rank = solution.rank;
  summary.condition_number = solution.condition_number;
  summary.indistinct = indistinct_combinations(solution, names);
}

TorqueComparison compare(const StaticResult& result, const Motion& motion) {
  TorqueComparison comparison = empty_comparison(motion);
  if (result.summary.parameters.empty()) return comparison;
  for (const Stretch& stretch : motion.stretches) {
    for (Eigen::Index i = stretch.first; i < stretch.end; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const Pose pose(motion.joint_rad.col(i), motion.hull_pitch_rad[i]);
      comparison.measured_Nm[at] = cylinder_torque(motion, i);
      comparison.modelled_Nm[at] = joint_torque(RigidArm::gravity(pose) * result.parameters);
      if (result.first_link > kBoom) comparison.modelled_Nm[at][kBoom] = std::numeric_limits<double>::quiet_NaN();
      comparison.usable[at] = 1;
    }
  }
  return comparison;
}

}  // namespace

StaticOptions all_measured_links(const MachineDescription& machine) {
  StaticOptions options;
  options.first_link = machine.sensors.without_pressures == kBoom ? kArm : kBoom;
  return options;
}

double still_m(const MachineDescription& machine) {
  return std::max(kLeastStill_m, 2 * length_steps_m(machine).maxCoeff());
}

std::vector<RestingPose> resting_poses(const MachineDescription& machine, const Recording& recording,
                                       const StaticOptions& options, int& near_stops) {
  const Motion motion = offline_motion(machine, recording, motion_options());
  std::vector<RestingPose> poses;
  JointVector last_rad = JointVector::Constant(std::numeric_limits<double>::infinity());
  for (const Stretch& stretch : motion.stretches) {
    for (const Stretch& rest : rests(motion, stretch, still_m(machine))) {
      if (static_cast<double>(rest.size()) * motion.step_s < options.rest_s) continue;
      const RestingPose pose = mean_pose(motion, {rest.first + rest.size() / 2, rest.end});
      const bool moved = (pose.joint_rad - last_rad).cwiseAbs().maxCoeff() > kStill_rad;
      last_rad = pose.joint_rad;
      if (!moved) continue;
      if (near_stop(machine, motion.cylinder_m.col(rest.end - 1), options.stop_margin_m))
        ++near_stops;
      else
        poses.push_back(pose);
    }
  }
  return poses;
}

StaticResult identify_static(const MachineDescription& machine, std::span<const Recording> recordings,
                             const StaticOptions& options) {
  StaticResult result;
  result.first_link = options.first_link;
  Identification& summary = result.summary;
  summary.method = "static";
  summary.columns = 2 * (kJoints - options.first_link);
  std::vector<RestingPose> poses;
  for (const Recording& recording : recordings) {
    const std::vector<RestingPose> found = resting_poses(machine, recording, options, result.near_stops);
    poses.insert(poses.end(), found.begin(), found.end());
    summary.duration_s += recording.duration_s();
  }
  result.poses = static_cast<int>(poses.size());
  summary.reasons.clear();
  const auto same_torque = [&](const RestingPose& pose) { return pose.torque_Nm == poses.front().torque_Nm; };
  if (result.poses < summary.columns) {
    summary.reasons = {std::to_string(result.poses) + " poses at rest; even with perfect sensors " +
                       std::to_string(summary.columns) + " are needed"};
    return result;
  }
  if (std::all_of(poses.begin(), poses.end(), same_torque)) {
    summary.reasons = {"every pose has the very same torques: pressures do not change"};
    return result;
  }
  fit_links(poses, result);
  if (summary.rank < summary.columns)
    summary.reasons.push_back("the poses are too much alike: rank " + std::to_string(summary.rank) + " of " +
                              std::to_string(summary.columns));
  if (result.poses < options.least_poses)
    summary.reasons.push_back(std::to_string(result.poses) + " poses at rest; at least " +
                              std::to_string(options.least_poses) + " are needed");
  summary.usable = summary.reasons.empty();
  if (result.near_stops > 0)
    summary.reasons.push_back(std::to_string(result.near_stops) + " poses near end stops were left out");
  return result;
}

TorqueComparison compare_torque(const StaticResult& result, const MachineDescription& machine,
                                const Recording& recording) {
  return compare(result, offline_motion(machine, recording, motion_options()));
}

std::vector<PlanarVector> external_force(const StaticResult& result, const MachineDescription& machine,
                                         const Recording& recording) {
  const Motion motion = offline_motion(machine, recording, motion_options());
  const auto solve = result.first_link == kBoom ? force_of_three_joints : force_of_two_joints;
  return solve_each(machine, motion, compare(result, motion), solve);
}

}  // namespace knuckle::estimation
