// Which poses to survey: D-optimal, greedy.
#include <algorithm>
#include <cmath>

#include "estimation/identification/kinematic_calibration.h"
#include "estimation/identification/survey_fit.h"
#include "machine/description.h"

namespace knuckle::estimation {
namespace {

constexpr std::size_t kCandidates = 400;

bool inside_walls(const LimitsDescription& limits, const PlanarVector& tip) {
  constexpr double kClear_m = 0.1;
  return tip.y() > limits.floor_m + kClear_m && tip.y() < limits.ceiling_m - kClear_m &&
         tip.x() < limits.reach_m - kClear_m;
}

/// Evenly spread over the joints' soft range: the additive recurrence of the plastic number's cousin in three
/// dimensions (Roberts 2018), g^4 = g + 1.
std::vector<JointVector> candidates(const MachineDescription& machine, const Kinematics& kinematics) {
  constexpr double kRoot = 1.2207440846057596;
  constexpr double kInside_rad = 0.01;  // of the soft wall: poses are reached with an error
  const JointVector step(1 / kRoot, 1 / (kRoot * kRoot), 1 / (kRoot * kRoot * kRoot));
  const double margin = machine.limits.joint_soft_margin_rad + kInside_rad;
  std::vector<JointVector> poses;
  for (std::size_t n = 1; n <= kCandidates; ++n) {
    JointVector pose;
    for (int i = 0; i < kJoints; ++i) {
      const LinkDescription& link = machine.links[static_cast<std::size_t>(i)];
      const double part = std::fmod(0.5 + static_cast<double>(n) * step[i], 1.0);
      pose[i] = link.min_rad + margin + part * (link.max_rad - link.min_rad - 2 * margin);
    }
    if (inside_walls(machine.limits, kinematics.tip(pose))) poses.push_back(pose);
  }
  return poses;
}

/// Rows of all three points of a pose, per prior standard deviation of each parameter.
Eigen::Matrix<double, 6, kGeometryCount> rows_of(const MachineDescription& machine, const Kinematics& kinematics,
                                                 const GeometryPrior& prior, const JointVector& pose) {
  constexpr double kPointSigma_m = 1e-3;
  JointVector reading;
  for (int i = 0; i < kJoints; ++i) {
    reading[i] = kinematics.cylinder_at(i, pose[i]).value().length_m + prior.mean[kEncoderOffset + i];
  }
  Eigen::Matrix<double, 6, kGeometryCount> rows;
  for (int link = 0; link < kJoints; ++link) {
    const SurveyPoint point{
        0, link, reading, PlanarVector::Zero(), whitening_of(kinematics, machine, pose, link, kPointSigma_m), true};
    rows.middleRows<2>(2 * link) = error_gradient(point, prior.mean, prior.sides) * prior.sigma.asDiagonal();
  }
  return rows;
}

/// Always on to the nearest pose that is left.
std::vector<JointVector> by_short_ways(std::vector<JointVector> poses) {
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const auto next = std::min_element(poses.begin() + static_cast<std::ptrdiff_t>(i), poses.end(),
                                       [&](const JointVector& a, const JointVector& b) {
                                         return (a - poses[i - 1]).norm() < (b - poses[i - 1]).norm();
                                       });
    std::iter_swap(poses.begin() + static_cast<std::ptrdiff_t>(i), next);
  }
  return poses;
}

}  // namespace

std::vector<JointVector> survey_poses(const MachineDescription& machine, std::size_t count) {
  const Kinematics kinematics(machine);
  const GeometryPrior prior = geometry_prior(machine, GeometryOptions{});
  const std::vector<JointVector> choice = candidates(machine, kinematics);
  std::vector<Eigen::Matrix<double, 6, kGeometryCount>> rows;
  for (const JointVector& pose : choice) rows.push_back(rows_of(machine, kinematics, prior, pose));

  GeometryMatrix information = GeometryMatrix::Identity();  // the prior
  std::vector<std::uint8_t> taken(choice.size(), 0);
  std::vector<JointVector> poses;
  while (poses.size() < std::min(count, choice.size())) {
    const GeometryMatrix covariance = information.inverse();
    std::size_t best = 0;
    double best_gain = -1;
    for (std::size_t i = 0; i < choice.size(); ++i) {
      if (taken[i]) continue;
      // det(I + R C R^T) is the factor by which the pose raises the information's determinant.
      const Eigen::Matrix<double, 6, 6> grown =
          Eigen::Matrix<double, 6, 6>::Identity() + rows[i] * covariance * rows[i].transpose();
      const double gain = grown.determinant();
      if (gain > best_gain) {
        best_gain = gain;
        best = i;
      }
    }
    taken[best] = 1;
    poses.push_back(choice[best]);
    information += rows[best].transpose() * rows[best];
  }
  return by_short_ways(poses);
}

}  // namespace knuckle::estimation
