#include <ceres/ceres.h>

#include <cmath>
#include <numbers>

#include "core/units.h"
#include "estimation/identification/baseline.h"
#include "estimation/identification/least_squares.h"
#include "estimation/regressor.h"
#include "machine/description.h"

namespace knuckle::estimation {
namespace {

constexpr double kLeastSpan_rad = 10 * kDegree;
constexpr double kKimSampling_s = 0.015;  // as in the paper; faster recordings are thinned
constexpr double kKimWindow_s = 0.105;  // of the quadratic that rates come from: 7 samples; the paper does not say how
constexpr double kLeastSlow_s = 20;     // less slow motion is refused
constexpr int kPerLink = 3;             // m L, A, mu
using LinkParameters = std::array<double, kPerLink>;

/// What one sample knows before any parameter does.
struct PoseSample {
  JointVector phi_rad;      ///< Absolute angles.
  JointVector rate_radps;   ///< Relative joints.
  JointVector known_Nm;     ///< Of m2 and m3 at the ends of the links before them.
  JointVector measured_Nm;  ///< Of the cylinders.
};

/// Model minus measured torque; equations (3) to (6) of the paper.
struct TorqueError {
  PoseSample sample;
  template <typename T>
  bool operator()(const T* boom, const T* arm, const T* bucket, T* error) const {
    const std::array<const T*, kJoints> links{boom, arm, bucket};
    T gravity(0);
    for (int i = kBucket; i >= kBoom; --i) {
      const T* link = links[static_cast<std::size_t>(i)];
      gravity += kGravity_mps2 * link[0] * cos(sample.phi_rad[i] + link[1]) + sample.known_Nm[i];
      error[i] = gravity + link[2] * sample.rate_radps[i] - sample.measured_Nm[i];
    }
    return true;
  }
};

/// Torque of masses fixed from the file that link i has at its far end: not yet summed over the later links.
JointVector known_torque(const KimModel& model, const JointVector& length_m, const JointVector& phi_rad) {
  return kGravity_mps2 * JointVector((model.arm_kg + model.bucket_kg) * length_m[kBoom] * std::cos(phi_rad[kBoom]),
                                     model.bucket_kg * length_m[kArm] * std::cos(phi_rad[kArm]), 0);
}

JointVector lengths(const MachineDescription& machine) {
  return {machine.links[0].length_m, machine.links[1].length_m, machine.links[2].length_m};
}

JointVector absolute_angles(const Motion& motion, Eigen::Index sample) {
  return absolute(motion.joint_rad.col(sample)).array() + motion.hull_pitch_rad[sample];
}

std::vector<PoseSample> samples(std::span<const Motion> motions, const KimModel& model, const JointVector& length_m) {
  std::vector<PoseSample> result;
  for (const Motion& motion : motions) {
    for (const Stretch& stretch : motion.stretches) {
      for (Eigen::Index i = stretch.first; i < stretch.end; ++i) {
        const JointVector phi = absolute_angles(motion, i);
        result.push_back(
            {phi, motion.joint_radps.col(i), known_torque(model, length_m, phi), cylinder_torque(motion, i)});
      }
    }
  }
  return result;
}

JointVector model_torque(const KimModel& model, const JointVector& length_m, const JointVector& phi_rad,
                         const JointVector& rate_radps) {
  TorqueError zero{{phi_rad, rate_radps, known_torque(model, length_m, phi_rad), JointVector::Zero()}};
  PerJoint<LinkParameters> links;
  for (int i = 0; i < kJoints; ++i) {
    links[static_cast<std::size_t>(i)] = {model.moment_kgm[i], model.offset_rad[i], model.friction_Nms[i]};
  }
  JointVector torque;
  zero(links[0].data(), links[1].data(), links[2].data(), torque.data());
  return torque;
}

const std::vector<std::string> kNames{"m1 L_O1G1", "A_mc1",     "mu1",   "m2 L_O2G2", "A_mc2",
                                      "mu2",       "m3 L_O3G3", "A_mc3", "mu3"};
const std::array<const char*, kPerLink> kUnits{"kg m", "deg", "N m/(deg/s)"};
/// SI to the units of table 1.
const std::array<double, kPerLink> kPrinted{1, 1 / kDegree, kDegree};

/// Finds the links' parameters. @return all torque errors about the solution, linearised: what is left to explain on
/// the right, in columns of kNames (SI).
LeastSquaresProblem fit_links(const std::vector<PoseSample>& samples, PerJoint<LinkParameters>& links) {
  ceres::Problem problem;
  for (const PoseSample& sample : samples) {
    using Cost = ceres::AutoDiffCostFunction<TorqueError, kJoints, kPerLink, kPerLink, kPerLink>;
    problem.AddResidualBlock(new Cost(new TorqueError{sample}), nullptr, links[0].data(), links[1].data(),
                             links[2].data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.logging_type = ceres::SILENT;
  options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 1e-14;
  options.max_num_iterations = 200;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);

  ceres::Problem::EvaluateOptions evaluate;
  evaluate.parameter_blocks = {links[0].data(), links[1].data(), links[2].data()};
  std::vector<double> errors;
  ceres::CRSMatrix jacobian;
  problem.Evaluate(evaluate, nullptr, &errors, nullptr, &jacobian);
  LeastSquaresProblem linear;
  linear.columns = Eigen::MatrixXd::Zero(jacobian.num_rows, jacobian.num_cols);
  linear.right = -Eigen::Map<const Eigen::VectorXd>(errors.data(), jacobian.num_rows);
  linear.weight = Eigen::VectorXd::Ones(jacobian.num_rows);
  for (int row = 0; row < jacobian.num_rows; ++row) {
    for (int at = jacobian.rows[static_cast<std::size_t>(row)]; at < jacobian.rows[static_cast<std::size_t>(row) + 1];
         ++at)
      linear.columns(row, jacobian.cols[static_cast<std::size_t>(at)]) = jacobian.values[static_cast<std::size_t>(at)];
  }
  return linear;
}

/// m L >= 0, and the angle in (-180, 180].
void make_unique(LinkParameters& link) {
  if (link[0] < 0) {
    link[0] = -link[0];
    link[1] += std::numbers::pi;
  }
  link[1] = std::remainder(link[1], 2 * std::numbers::pi);
}

void add_parameters(Identification& summary, const PerJoint<LinkParameters>& links, const KimModel& model,
                    const Eigen::MatrixXd& covariance) {
  Eigen::VectorXd scale(kPerLink * kJoints);
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    const std::size_t kind = i % kPerLink;
    const auto at = static_cast<Eigen::Index>(i);
    scale[at] = kPrinted[kind];
    summary.parameters.push_back({kNames[i], kUnits[kind], kPrinted[kind] * links[i / kPerLink][kind],
                                  kPrinted[kind] * std::sqrt(covariance(at, at)), false});
  }
  summary.parameters.push_back({"m2", "kg", model.arm_kg, 0, true});
  summary.parameters.push_back({"m3", "kg", model.bucket_kg, 0, true});
  const auto count = static_cast<Eigen::Index>(summary.parameters.size());
  summary.covariance = Eigen::MatrixXd::Zero(count, count);
  summary.covariance.topLeftCorner(scale.size(), scale.size()) = scale.asDiagonal() * covariance * scale.asDiagonal();
}

TorqueComparison compare(const KimResult& result, const MachineDescription& machine, const Motion& motion) {
  TorqueComparison comparison = empty_comparison(motion);
  if (result.summary.parameters.empty()) return comparison;
  for (const Stretch& stretch : motion.stretches) {
    for (Eigen::Index i = stretch.first; i < stretch.end; ++i) {
      const auto at = static_cast<std::size_t>(i);
      comparison.measured_Nm[at] = cylinder_torque(motion, i);
      comparison.modelled_Nm[at] =
          model_torque(result.model, lengths(machine), absolute_angles(motion, i), motion.joint_radps.col(i));
      comparison.usable[at] = 1;
    }
  }
  return comparison;
}

Motion paper_motion(const MachineDescription& machine, const Recording& recording) {
  return offline_motion(machine, recording, {.window_s = kKimWindow_s, .order = 2});
}

}  // namespace

KimResult identify_kim(const MachineDescription& machine, std::span<const Recording> recordings) {
  KimResult result;
  Identification& summary = result.summary;
  summary.method = "kim";
  summary.columns = kPerLink * kJoints;
  result.model.arm_kg = machine.links[kArm].mass_kg;
  result.model.bucket_kg = machine.links[kBucket].mass_kg;

  std::vector<Motion> motions;
  for (const Recording& recording : recordings) {
    motions.push_back(paper_motion(machine, thinned(recording, kKimSampling_s)));
    summary.duration_s += motions.back().duration_s();
  }
  summary.reasons = unfit(motions, kBoom, kLeastSlow_s, kLeastSpan_rad);
  if (!summary.reasons.empty()) return result;

  const std::vector<PoseSample> data = samples(motions, result.model, lengths(machine));
  PerJoint<LinkParameters> links;
  links.fill({20, 0, 0});
  const LeastSquaresSolution about = solve_least_squares(fit_links(data, links));
  for (LinkParameters& link : links) make_unique(link);
  summary.rank = about.rank;
  summary.condition_number = about.condition_number;
  summary.indistinct = indistinct_combinations(about, kNames);
  add_parameters(summary, links, result.model, about.naive);
  for (int i = 0; i < kJoints; ++i) {
    const LinkParameters& link = links[static_cast<std::size_t>(i)];
    result.model.moment_kgm[i] = link[0];
    result.model.offset_rad[i] = link[1];
    result.model.friction_Nms[i] = link[2];
  }
  summary.usable = summary.rank == summary.columns;
  if (!summary.usable) summary.reasons.push_back("the motion does not separate all parameters");
  summary.reasons.push_back("m2 and m3 are the machine file's: only 6 of 8 gravity unknowns show in the torques");
  return result;
}

TorqueComparison compare_torque(const KimResult& result, const MachineDescription& machine,
                                const Recording& recording) {
  return compare(result, machine, paper_motion(machine, recording));
}

std::vector<PlanarVector> external_force(const KimResult& result, const MachineDescription& machine,
                                         const Recording& recording) {
  const Motion motion = paper_motion(machine, recording);
  return solve_each(machine, motion, compare(result, machine, motion), force_of_three_joints);
}

std::vector<Eigen::Vector3d> external_wrench(const KimResult& result, const MachineDescription& machine,
                                             const Recording& recording) {
  const Motion motion = paper_motion(machine, recording);
  return solve_each(machine, motion, compare(result, machine, motion), wrench_of_three_joints);
}

}  // namespace knuckle::estimation
