#include "estimation/identification/survey_points.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/error.h"
#include "core/quantile.h"
#include "estimation/identification/kinematic_calibration.h"
#include "machine/description.h"

namespace knuckle::estimation {
namespace {

constexpr double kMostOff = 0.05;      // of the reach: far above what pins and encoders explain
constexpr double kMostSigmas = 5;      // of the drawing's tolerances, on top
constexpr double kMostLost = 0.25;     // of the poses
constexpr double kLeastSpread = 0.25;  // of a joint's working range
constexpr double kSamePose_rad = 0.02;

const PlanarVector& point_of(const SurveyPose& pose, int link) {
  return link == kBoom ? pose.arm_pin_m : link == kArm ? pose.bucket_pin_m : pose.tip_m;
}

/// A pose that the drawing can take.
struct StandingPose {
  std::size_t number;  ///< In the survey, from 1.
  const SurveyPose* survey;
  JointVector joints_rad;
};

class Selection {
 public:
  Selection(const MachineDescription& nominal, const Survey& survey)
      : nominal_(nominal), survey_(survey), kinematics_(nominal), prior_(geometry_prior(nominal)) {
    for (const LinkDescription& link : nominal.links) reach_m_ += link.length_m;
  }

  SurveyPoints run() {
    stand();
    judge_poses();
    for (int link = 0; link < kJoints && result_.refusals.empty(); ++link) judge_points(link);
    if (result_.refusals.empty()) take_points();
    return std::move(result_);
  }

 private:
  /// Poses whose readings are lengths the cylinders can have.
  void stand() {
    std::size_t lost = 0;
    for (std::size_t n = 0; n < survey_.poses.size(); ++n) {
      const SurveyPose& pose = survey_.poses[n];
      StandingPose standing{n + 1, &pose, {}};
      int joint = 0;
      for (; joint < kJoints; ++joint) {
        const double length = pose.cylinder_m[joint] - nominal_.sensors.encoder_offset_m[joint];
        const auto angle = kinematics_.joint_at(joint, length);
        if (!angle) break;
        standing.joints_rad[joint] = *angle;
      }
      if (joint == kJoints) {
        standing_.push_back(standing);
      } else if (++lost; true) {
        result_.left_out.push_back("pose " + std::to_string(n + 1) + ": " + unreachable(joint, pose.cylinder_m[joint]));
      }
    }
    if (static_cast<double>(lost) > kMostLost * static_cast<double>(survey_.poses.size())) {
      result_.refusals.push_back(std::to_string(lost) + " of " + std::to_string(survey_.poses.size()) +
                                 " poses cannot be reached; " + result_.left_out.front());
    }
  }

  [[nodiscard]] std::string unreachable(int joint, double reading) const {
    const auto i = static_cast<std::size_t>(joint);
    const CylinderDescription& cylinder = nominal_.cylinders[i];
    const double ratio = reading / (0.5 * (cylinder.min_length_m + cylinder.max_length_m));
    return std::string(kJointNames[i]) +
           fmt::format(
               " encoder reads {:.4g} m, which no angle of the working range gives (cylinder {:.3f} to {:.3f} m)",
               reading, cylinder.min_length_m, cylinder.max_length_m) +
           (ratio > 300 && ratio < 3000 ? ": looks like millimetres" : "");
  }

  void judge_poses() {
    std::vector<JointVector> distinct;
    JointVector low = JointVector::Constant(1e9), high = -low;
    for (const StandingPose& pose : standing_) {
      low = low.cwiseMin(pose.joints_rad);
      high = high.cwiseMax(pose.joints_rad);
      const bool known = std::any_of(distinct.begin(), distinct.end(), [&](const JointVector& other) {
        return (other - pose.joints_rad).cwiseAbs().maxCoeff() < kSamePose_rad;
      });
      if (!known) distinct.push_back(pose.joints_rad);
    }
    if (distinct.size() < kLeastPoses) {
      result_.refusals.push_back(std::to_string(distinct.size()) + " different poses of " +
                                 std::to_string(survey_.poses.size()) + "; at least " + std::to_string(kLeastPoses) +
                                 " are needed");
      return;
    }
    for (int i = 0; i < kJoints; ++i) {
      const LinkDescription& link = nominal_.links[static_cast<std::size_t>(i)];
      const double part = (high[i] - low[i]) / (link.max_rad - link.min_rad);
      if (part < kLeastSpread) {
        result_.refusals.push_back(std::string("the ") + kJointNames[static_cast<std::size_t>(i)] +
                                   fmt::format(" moved over {:.0f} % of its range; at least {:.0f} % is needed",
                                               100 * part, 100 * kLeastSpread));
      }
    }
  }

  [[nodiscard]] PlanarVector nominal_point(const StandingPose& pose, int link) const {
    PlanarVector at = PlanarVector::Zero();
    for (int i = 0; i <= link; ++i) {
      const double along = pose.joints_rad.head(i + 1).sum();
      at += nominal_.links[static_cast<std::size_t>(i)].length_m * PlanarVector(std::cos(along), std::sin(along));
    }
    return at;
  }

  using Change = std::function<PlanarVector(const PlanarVector&)>;
  [[nodiscard]] double median_off(int link, const Change& change) const {
    std::vector<double> off;
    for (const StandingPose& pose : standing_) {
      const PlanarVector& at = point_of(*pose.survey, link);
      if (at.allFinite()) off.push_back((change(at) - nominal_point(pose, link)).norm());
    }
    return upper_median(off);
  }

  /// Points of one kind that are off in the median are a mistake of the whole survey.
  void judge_points(int link) {
    const std::string name = kPointNames[static_cast<std::size_t>(link)];
    const double bound = kMostOff * reach_m_;
    const double off = median_off(link, [](const PlanarVector& p) { return p; });
    if (off <= bound) return;
    static const std::vector<std::pair<const char*, Change>> kMistakes{
        {"in millimetres", [](const PlanarVector& p) { return PlanarVector(1e-3 * p); }},
        {"with x mirrored", [](const PlanarVector& p) { return PlanarVector(-p.x(), p.y()); }},
        {"with z mirrored", [](const PlanarVector& p) { return PlanarVector(p.x(), -p.y()); }},
        {"with x and z swapped", [](const PlanarVector& p) { return PlanarVector(p.y(), p.x()); }}};
    std::string line = name + fmt::format(" is {:.3g} m off the drawing in the median (bound {:.3g} m)", off, bound);
    for (const auto& [mistake, change] : kMistakes) {
      if (median_off(link, change) <= bound) line += std::string(": looks ") + mistake;
    }
    for (int other = 0; other < kJoints; ++other) {
      if (other != link && looks_like(link, other, bound)) {
        line += std::string(": looks like the ") + kPointNames[static_cast<std::size_t>(other)];
      }
    }
    result_.refusals.push_back(line);
  }

  [[nodiscard]] bool looks_like(int link, int other, double bound) const {
    std::vector<double> off;
    for (const StandingPose& pose : standing_) {
      const PlanarVector& at = point_of(*pose.survey, link);
      if (at.allFinite()) off.push_back((at - nominal_point(pose, other)).norm());
    }
    return upper_median(off) <= bound;
  }

  /// How far the drawing's tolerances move the point, to first order; far where a lever is short.
  [[nodiscard]] double nominal_sigma(const StandingPose& pose, int link) const {
    const SurveyPoint point{
        pose.number, link, pose.survey->cylinder_m, PlanarVector::Zero(), Eigen::Matrix2d::Identity(), true};
    return (error_gradient(point, prior_.mean, prior_.sides) * prior_.sigma.asDiagonal()).norm();
  }

  void take_points() {
    for (const StandingPose& pose : standing_) {
      const std::size_t before = result_.points.size();
      for (int link = 0; link < kJoints; ++link) {
        const PlanarVector& at = point_of(*pose.survey, link);
        if (!at.allFinite()) continue;
        const double off = (at - nominal_point(pose, link)).norm();
        if (off > kMostOff * reach_m_ + kMostSigmas * nominal_sigma(pose, link)) {
          result_.left_out.push_back("pose " + std::to_string(pose.number) + ": " +
                                     kPointNames[static_cast<std::size_t>(link)] +
                                     fmt::format(" is {:.3g} m off the drawing", off));
          continue;
        }
        result_.points.push_back({pose.number, link, pose.survey->cylinder_m, at,
                                  whitening_of(kinematics_, nominal_, pose.joints_rad, link, survey_.point_sigma_m),
                                  true});
      }
      if (result_.points.size() > before) ++result_.poses;
    }
    if (result_.poses < kLeastPoses) {
      result_.refusals.push_back(std::to_string(result_.poses) + " poses have a usable point; at least " +
                                 std::to_string(kLeastPoses) + " are needed");
    }
  }

  const MachineDescription& nominal_;
  const Survey& survey_;
  Kinematics kinematics_;
  GeometryPrior prior_;
  double reach_m_ = 0;
  std::vector<StandingPose> standing_;
  SurveyPoints result_;
};

}  // namespace

SurveyPoints select_points(const MachineDescription& nominal, const Survey& survey) {
  if (!(survey.point_sigma_m > 0)) throw InputError(survey.source + ": point sigma must be above 0 m");
  return Selection(nominal, survey).run();
}

// Which poses to survey: D-optimal, greedy.

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
  const GeometryPrior prior = geometry_prior(machine);
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
