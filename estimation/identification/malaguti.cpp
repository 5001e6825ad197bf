#include <cmath>
#include <numbers>

#include "core/units.h"
#include "estimation/identification/baseline.h"
#include "estimation/identification/least_squares.h"
#include "estimation/observer.h"

namespace knuckle::estimation {
namespace {

constexpr double kLeastArmSpan_rad = 10 * kDegree;
constexpr double kSettled = 6;  // time constants until a filter has forgotten how it started
constexpr int kRows = 2;        // bucket, stick
constexpr int kInertial = 6;
enum Column { kJ3, kJ2, kX3, kZ3, kX2, kZ2, kCoulomb3, kViscous3, kCoulomb2, kViscous2 };
/// Which of the nine base parameters each inertial column is.
constexpr std::array<int, kInertial> kBase{kInertia + kBucket, kInertia + kArm, kMomentX + kBucket,
                                           kMomentZ + kBucket, kMomentX + kArm, kMomentZ + kArm};
constexpr std::array<int, kRows> kLinks{kBucket, kArm};

using Inertial = Eigen::Matrix<double, kRows, kInertial>;
using Columns = Eigen::Matrix<double, kRows, kMalagutiCount>;
using Torques = Eigen::Matrix<double, kRows, 1>;

/// One sample behind the filter: torques = columns * parameters + noise.
struct FilteredRow {
  Eigen::Index sample;
  Columns columns;
  Torques torques;
};

MotionOptions motion_options(const MalagutiOptions& options) {
  MotionOptions motion;
  motion.window_s = options.window_s;
  motion.order = options.order;
  motion.smooth = MotionOptions::Smooth::kJointAngle;
  return motion;
}

Inertial two_links(const Regressor& three_links) {
  Inertial two;
  for (std::size_t row = 0; row < kLinks.size(); ++row) {
    for (std::size_t k = 0; k < kBase.size(); ++k)
      two(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(k)) = three_links(kLinks[row], kBase[k]);
  }
  return two;
}

double sign(double value) {
  return value > 0 ? 1 : value < 0 ? -1 : 0;
}

/// Everything that passes the filter as it is: Y_v, friction, and the torques in the last column.
using Passed = Eigen::Matrix<double, kRows, kMalagutiCount + 1>;

Passed passed(const RigidArm& arm, const Motion& motion, Eigen::Index i, const Pose& pose, const JointVector& rate) {
  Passed row = Passed::Zero();
  row.leftCols<kInertial>() = two_links(arm.velocity_products(pose, rate) + RigidArm::gravity(pose));
  const JointVector lever = motion.lever_m.col(i), speed = motion.cylinder_mps.col(i);
  for (const auto& [joint, column] : {std::pair{kBucket, kCoulomb3}, std::pair{kArm, kCoulomb2}}) {
    row(joint == kBucket ? 0 : 1, column) = lever[joint] * sign(speed[joint]);
    row(joint == kBucket ? 0 : 1, column + 1) = lever[joint] * speed[joint];
  }
  row.block<1, 2>(1, kCoulomb3) = -row.block<1, 2>(0, kCoulomb3);
  const JointVector torque = cylinder_torque(motion, i);
  row.rightCols<1>() << torque[kBucket], torque[kArm] - torque[kBucket];
  return row;
}

std::vector<FilteredRow> filtered_rows(const RigidArm& arm, const Motion& motion, double filter_Hz) {
  const double a = 2 * std::numbers::pi * filter_Hz;
  const auto settling = static_cast<Eigen::Index>(std::ceil(kSettled / (a * motion.step_s)));
  std::vector<FilteredRow> rows;
  for (const Stretch& stretch : motion.stretches) {
    FohFilter<Inertial> momentum_filter(filter_Hz, motion.step_s);
    FohFilter<Passed> filter(filter_Hz, motion.step_s);
    for (Eigen::Index i = stretch.first; i < stretch.end; ++i) {
      const Pose pose(motion.joint_rad.col(i), motion.hull_pitch_rad[i]);
      const JointVector rate = absolute(motion.joint_radps.col(i));
      const Inertial momentum = two_links(arm.momentum(pose, rate));
      const Passed now = passed(arm, motion, i, pose, rate);
      if (i == stretch.first) {
        momentum_filter.reset(momentum);
        filter.reset(now);
      }
      const Passed& through = filter.step(now);
      FilteredRow row{i, through.leftCols<kMalagutiCount>(), through.rightCols<1>()};
      row.columns.leftCols<kInertial>() += a * (momentum - momentum_filter.step(momentum));
      if (i - stretch.first >= settling) rows.push_back(row);
    }
  }
  return rows;
}

const std::vector<std::string> kDirectNames{"phi_D1", "phi_D2", "phi_S1", "phi_S2", "phi_S3",
                                            "phi_S4", "phi_f1", "phi_f2", "phi_f3", "phi_f4"};
const std::vector<std::string> kDirectUnits{"kg m^2", "kg m^2",   "kg m", "kg m",     "kg m",
                                            "kg m",   "kg m/s^2", "kg/s", "kg m/s^2", "kg/s"};

/// Two groups: each row of the balance has its own noise.
LeastSquaresProblem stacked(const std::vector<FilteredRow>& rows) {
  const auto count = kRows * static_cast<Eigen::Index>(rows.size());
  LeastSquaresProblem problem;
  problem.columns.resize(count, kMalagutiCount);
  problem.right.resize(count);
  problem.weight = Eigen::VectorXd::Ones(count);
  Eigen::Index at = 0;
  for (const FilteredRow& row : rows) {
    problem.columns.middleRows<kRows>(at) = row.columns;
    problem.right.segment<kRows>(at) = row.torques;
    for (int n = 0; n < kRows; ++n) problem.group.push_back(n);
    at += kRows;
  }
  return problem;
}

TorqueComparison compare(const MalagutiResult& result, const MachineDescription& machine, const Motion& motion) {
  TorqueComparison comparison = empty_comparison(motion);
  if (result.summary.parameters.empty()) return comparison;
  for (const FilteredRow& row : filtered_rows(RigidArm(machine), motion, result.options.filter_Hz)) {
    const auto at = static_cast<std::size_t>(row.sample);
    const Torques modelled = row.columns * result.parameters;
    comparison.measured_Nm[at].tail<2>() << row.torques.sum(), row.torques[0];
    comparison.modelled_Nm[at].tail<2>() << modelled.sum(), modelled[0];
    comparison.usable[at] = 1;
  }
  return comparison;
}

}  // namespace

MalagutiResult identify_malaguti(const MachineDescription& machine, std::span<const Recording> recordings,
                                 const MalagutiOptions& options) {
  MalagutiResult result;
  result.options = options;
  Identification& summary = result.summary;
  summary.method = "malaguti";
  summary.columns = kMalagutiCount;
  std::vector<Motion> motions;
  std::vector<FilteredRow> rows;
  for (const Recording& recording : recordings) {
    motions.push_back(offline_motion(machine, thinned(recording, options.sampling_s), motion_options(options)));
    summary.duration_s += motions.back().duration_s();
    const auto more = filtered_rows(RigidArm(machine), motions.back(), options.filter_Hz);
    rows.insert(rows.end(), more.begin(), more.end());
  }
  summary.reasons = unfit(motions, kArm, options.least_s, kLeastArmSpan_rad);
  if (!summary.reasons.empty()) return result;

  const LeastSquaresSolution solution = solve_least_squares(stacked(rows));
  result.parameters = solution.parameters;
  summary.rank = solution.rank;
  summary.condition_number = solution.condition_number;
  summary.indistinct = indistinct_combinations(solution, kDirectNames);
  summary.covariance = solution.naive;
  for (int k = 0; k < kMalagutiCount; ++k) {
    const auto at = static_cast<std::size_t>(k);
    summary.parameters.push_back(
        {kDirectNames[at], kDirectUnits[at], solution.parameters[k], std::sqrt(summary.covariance(k, k)), false});
  }
  summary.usable = summary.rank == summary.columns;
  if (!summary.usable) summary.reasons.push_back("the motion does not separate all parameters");
  return result;
}

TorqueComparison compare_torque(const MalagutiResult& result, const MachineDescription& machine,
                                const Recording& recording) {
  return compare(result, machine, offline_motion(machine, recording, motion_options(result.options)));
}

std::vector<PlanarVector> external_force(const MalagutiResult& result, const MachineDescription& machine,
                                         const Recording& recording) {
  const Motion motion = offline_motion(machine, recording, motion_options(result.options));
  return solve_each(machine, motion, compare(result, machine, motion), force_of_two_joints);
}

}  // namespace knuckle::estimation
