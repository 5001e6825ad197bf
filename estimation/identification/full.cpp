#include "estimation/identification/full.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "estimation/bias_filter.h"
#include "estimation/identification/baseline.h"
#include "estimation/identification/filtered_regressor.h"
#include "estimation/identification/least_squares.h"
#include "estimation/identification/smoothing.h"
#include "estimation/regressor.h"
#include "machine/description.h"
#include "machine/encoder_length.h"

namespace knuckle::estimation {
namespace {

constexpr double kRankTolerance = 1e-4;
constexpr double kLeastVaf = 0.8;  ///< Below it the model is not of this machine.

std::vector<int> measured_joints(const MachineDescription& machine) {
  std::vector<int> joints;
  for (int j = 0; j < kJoints; ++j)
    if (j != machine.sensors.without_pressures) joints.push_back(j);
  return joints;
}

/// Rows of all recordings, in turn of the joints whose torque is measured, thinned out to what the filters leave of
/// independent information.
class Rows {
 public:
  Rows(const RigidArm& arm, std::vector<int> joints, const FullOptions& options)
      : arm_(arm), joints_(std::move(joints)), options_(options) {}

  void add(const Motion& motion) {
    const FilteredRegressor regressor = filtered_regressor(arm_, motion, options_.regressor);
    // Ten samples in a time constant over 2 pi of the pole.
    const auto stride = std::max<Eigen::Index>(1, std::lround(0.1 / (options_.regressor.pole_Hz * motion.step_s)));
    const auto block = std::max<Eigen::Index>(1, std::lround(options_.cluster_s / motion.step_s));
    for (const Stretch& stretch : regressor.stretches) {
      for (Eigen::Index n = stretch.first; n < stretch.end; n += stride) {
        const int cluster = first_cluster_ + static_cast<int>(n / block);
        for (std::size_t k = 0; k < joints_.size(); ++k) add(regressor, motion, n, k, cluster);
      }
    }
    levers_m_ += motion.lever_m.cwiseAbs().array().isNaN().select(0, motion.lever_m.cwiseAbs()).sum();
    lever_count_ += static_cast<double>(kJoints * total_size(motion.stretches));
    first_cluster_ += 1 + static_cast<int>(motion.size() / block);
  }
  [[nodiscard]] bool empty() const { return right_.empty(); }
  [[nodiscard]] double mean_lever_m() const { return levers_m_ / lever_count_; }

  [[nodiscard]] LeastSquaresProblem problem() const {
    LeastSquaresProblem p;
    const auto rows = static_cast<Eigen::Index>(right_.size());
    p.columns = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, kCalibrationCount, Eigen::RowMajor>>(
        columns_.data(), rows, kCalibrationCount);
    p.right = Eigen::Map<const Eigen::VectorXd>(right_.data(), rows);
    p.weight = Eigen::Map<const Eigen::VectorXd>(weight_.data(), rows);
    p.trust = Eigen::Map<const Eigen::VectorXd>(trust_.data(), rows);
    p.group = group_;
    p.cluster = cluster_;
    return p;
  }

 private:
  void add(const FilteredRegressor& regressor, const Motion& motion, Eigen::Index n, std::size_t which, int cluster) {
    const int joint = joints_[which];
    const std::size_t at = columns_.size();
    columns_.resize(at + kCalibrationCount, 0);
    for (int k = 0; k < kBaseCount; ++k)
      columns_[at + static_cast<std::size_t>(k)] = regressor.base(kBaseCount * joint + k, n);
    for (int k = 0; k < kFrictionCount && options_.friction; ++k)
      columns_[at + static_cast<std::size_t>(kBaseCount + kFrictionCount * joint + k)] =
          regressor.friction(kFrictionCount * joint + k, n);
    right_.push_back(regressor.right(joint, n));
    weight_.push_back(options_.weighted ? lever_weight(motion.lever_m(joint, n)) : 1);
    trust_.push_back(options_.weighted ? regressor.trust(joint, n) : 1);
    group_.push_back(options_.weighted ? static_cast<int>(which) : 0);
    cluster_.push_back(cluster);
  }

  const RigidArm& arm_;
  std::vector<int> joints_;
  const FullOptions& options_;
  int first_cluster_ = 0;
  double levers_m_ = 0, lever_count_ = 0;
  std::vector<double> columns_, right_, weight_, trust_;
  std::vector<int> group_, cluster_;
};

/// Less than this in a column (root mean square) is rest: a hundredth of what encoder steps make of it in motion.
/// Columns with more noise than signal are kept on purpose: their bias is to be seen, not hidden.
CalibrationVector column_noise(const MachineDescription& machine, const FullOptions& options, double step_s,
                               double lever_m) {
  constexpr double kShare = 0.01, kBristle = 0.02, kLoad_N = 1000, kPressure_Pa = 5e5;
  const int half = smoothing_half_window(options.motion, step_s);
  const double derivative = savitzky_golay(half, options.motion.order, 1, step_s).norm();
  const double speed_mps = std::max(1e-9, kShare * length_steps_m(machine).maxCoeff() / std::sqrt(12.0) * derivative);
  CalibrationVector noise = CalibrationVector::Zero();
  noise.head<kJoints>().setConstant(2 * std::numbers::pi * options.regressor.pole_Hz * speed_mps / lever_m);
  for (int j = 0; j < kJoints; ++j) {
    noise.segment<kFrictionCount>(friction_index(j, kCoulombExtend)).setConstant(kBristle * lever_m);
    noise[friction_index(j, kViscous)] = speed_mps * lever_m;
    noise[friction_index(j, kLoadShare)] *= kLoad_N;
    noise[friction_index(j, kSeal)] *= kPressure_Pa;
  }
  return noise;
}

/// Columns that are there by the options and by what the machine measures.
std::vector<int> active_columns(const MachineDescription& machine, const FullOptions& options) {
  const std::vector<int> unseen = unseen_columns(machine);
  std::vector<int> active;
  for (int k = 0; k < kCalibrationCount; ++k) {
    const int friction = k < kBaseCount ? -1 : (k - kBaseCount) % kFrictionCount;
    const bool off = (friction >= 0 && !options.friction) ||
                     (friction == kBreakaway && !options.regressor.friction.stribeck) ||
                     (friction == kLoadShare && !options.regressor.friction.load) ||
                     (friction == kSeal && !options.regressor.friction.seal);
    if (!off && std::find(unseen.begin(), unseen.end(), k) == unseen.end()) active.push_back(k);
  }
  return active;
}

std::vector<std::string> names_of(const std::vector<IdentifiedParameter>& parameters, const std::vector<int>& which) {
  std::vector<std::string> names;
  for (const int k : which) names.push_back(parameters[static_cast<std::size_t>(k)].name);
  return names;
}

/// Reasons from the fit itself: a joint the model does not explain.
void judge_fit(const LeastSquaresProblem& problem, const LeastSquaresSolution& solution, const std::vector<int>& joints,
               std::vector<std::string>& reasons) {
  for (std::size_t j = 0; j < joints.size(); ++j) {
    double n = 0, sum = 0, squares = 0, errors = 0;
    for (Eigen::Index i = 0; i < problem.right.size(); ++i) {
      if (i % std::ssize(joints) != static_cast<Eigen::Index>(j)) continue;
      n += 1;
      sum += problem.right[i];
      squares += problem.right[i] * problem.right[i];
      errors += solution.residual[i] * solution.residual[i];
    }
    const double vaf = 1 - (errors / n) / (squares / n - sum * sum / (n * n));
    if (vaf >= kLeastVaf) continue;
    reasons.push_back(
        fmt::format("the model explains only {:.2g} % of the {}'s torque, at least {:.2g} % are needed: is a channel "
                    "wrong in sign, "
                    "side or unit?",
                    std::max(0.0, 100 * vaf), kJointNames[static_cast<std::size_t>(joints[j])], 100 * kLeastVaf));
  }
}

/// unseen_columns() as drawn, 0 where a drawing says nothing; the others 0.
CalibrationVector kept_from_drawing(const MachineDescription& machine) {
  const CalibrationVector drawn = drawn_parameters(machine);
  CalibrationVector kept = CalibrationVector::Zero();
  for (const int k : unseen_columns(machine))
    if (std::isfinite(drawn[k])) kept[k] = drawn[k];
  return kept;
}

/// As far as the bias filter doubts a machine as drawn. An inertia holds the square of the lengths that a moment holds;
/// breakaway is a share of Coulomb friction.
void add_doubt_of_drawing(MachineDescription machine, CalibrationMatrix& covariance) {
  const std::vector<int> unseen = unseen_columns(machine);
  if (unseen.empty()) return;
  machine.dynamics_calibration.reset();
  const BiasMatrix doubt = BiasFilter(machine).covariance();
  const CalibrationVector drawn = drawn_parameters(machine);
  const int joint = machine.sensors.without_pressures;
  const double offset = doubt(kBiasOffset + joint, kBiasOffset + joint),
               coulomb = doubt(kBiasCoulomb + joint, kBiasCoulomb + joint);
  const int extend = friction_index(joint, kCoulombExtend), retract = friction_index(joint, kCoulombRetract);
  covariance(extend, extend) = covariance(retract, retract) = coulomb + offset;
  covariance(extend, retract) = covariance(retract, extend) = coulomb - offset;
  const auto set = [&](FrictionIndex which, double variance) {
    covariance(friction_index(joint, which), friction_index(joint, which)) = variance;
  };
  set(kViscous, doubt(kBiasViscous + joint, kBiasViscous + joint));
  set(kSeal, doubt(kBiasSeal + joint, kBiasSeal + joint));
  const double breakaway_share = drawn[friction_index(joint, kBreakaway)] / drawn[extend];
  set(kBreakaway, breakaway_share * breakaway_share * coulomb);
  if (joint != kBoom) return;
  const double x = doubt(kBiasMomentX, kBiasMomentX), z = doubt(kBiasMomentZ, kBiasMomentZ);
  covariance(kMomentX, kMomentX) = x;
  covariance(kMomentZ, kMomentZ) = z;
  covariance(kInertia, kInertia) = 4 * drawn[kInertia] * drawn[kInertia] * (x + z) /
                                   (drawn[kMomentX] * drawn[kMomentX] + drawn[kMomentZ] * drawn[kMomentZ]);
}

std::string unseen_text(const MachineDescription& machine) {
  const std::string joint = kJointNames[static_cast<std::size_t>(machine.sensors.without_pressures)];
  return "nobody measures the " + joint + " cylinder's pressures: its friction" +
         (machine.sensors.without_pressures == kBoom ? ", J1, X1 and Z1 are" : " is") +
         " the machine file's, and no standard deviation contains how far the " + joint + " bends behind its encoder";
}

template <typename Matrix>
CalibrationMatrix spread(const Matrix& of_active, const std::vector<int>& active) {
  CalibrationMatrix all = CalibrationMatrix::Zero();
  all(active, active) = of_active;
  return all;
}

void set_sigmas(Identification& summary) {
  for (int k = 0; k < kCalibrationCount; ++k)
    summary.parameters[static_cast<std::size_t>(k)].sigma = std::sqrt(summary.covariance(k, k));
}

void fill(FullResult& result, const MachineDescription& machine, const FullOptions& options) {
  Identification& summary = result.summary;
  result.dynamics.stribeck_mps.setConstant(options.regressor.friction.stribeck_mps);
  result.dynamics.covariance = result.sandwich_covariance;
  if (options.model_error)
    result.dynamics.covariance += *options.model_error;
  else
    add_doubt_of_drawing(machine, result.dynamics.covariance);
  summary.sigmas = options.model_error ? Identification::Sigmas::kWithModelError : Identification::Sigmas::kOfResiduals;
  summary.covariance = result.dynamics.covariance;
  for (int k = 0; k < kCalibrationCount; ++k)
    summary.parameters[static_cast<std::size_t>(k)].value = result.dynamics.parameters[k];
  for (const int k : unseen_columns(machine)) summary.parameters[static_cast<std::size_t>(k)].fixed = true;
  set_sigmas(summary);
}

}  // namespace

std::vector<int> unseen_columns(const MachineDescription& machine) {
  const int joint = machine.sensors.without_pressures;
  if (joint == SensorDescription::kNone) return {};
  std::vector<int> unseen;
  if (joint == kBoom) unseen = {kInertia, kMomentX, kMomentZ};
  for (int k = 0; k < kFrictionCount; ++k) unseen.push_back(friction_index(joint, kCoulombExtend) + k);
  return unseen;
}

CalibrationVector drawn_parameters(const MachineDescription& machine) {
  CalibrationVector values = CalibrationVector::Constant(std::numeric_limits<double>::quiet_NaN());
  values.head<kBaseCount>() = lumped_parameters(machine);
  for (int j = 0; j < kJoints; ++j) {
    const FrictionDescription& friction = machine.cylinders[static_cast<std::size_t>(j)].friction;
    values[friction_index(j, kCoulombExtend)] = values[friction_index(j, kCoulombRetract)] = friction.coulomb_N;
    values[friction_index(j, kViscous)] = friction.viscous_Ns_per_m;
    values[friction_index(j, kBreakaway)] = friction.coulomb_N * (friction.static_ratio - 1);
  }
  return values;
}

std::vector<IdentifiedParameter> calibration_names() {
  std::vector<IdentifiedParameter> names;
  for (const auto& [letter, unit] : {std::pair{"J", "kg m^2"}, std::pair{"X", "kg m"}, std::pair{"Z", "kg m"}}) {
    for (int i = 1; i <= kJoints; ++i) names.push_back({letter + std::to_string(i), unit, 0, 0, false});
  }
  for (const char* joint : kJointNames) {
    const std::string name = joint;
    for (const auto& [parameter, unit] : {std::pair{" F_c extend", "N"},
                                          {" F_c retract", "N"},
                                          {" F_v", "N s/m"},
                                          {" F_b", "N"},
                                          {" k", "1"},
                                          {" a", "m^2"}})
      names.push_back({name + parameter, unit, 0, 0, false});
  }
  return names;
}

namespace {

/// Least squares of all recordings together.
struct Solved {
  LeastSquaresProblem problem;  ///< Of the active columns.
  std::vector<int> active;
  LeastSquaresSolution solution;
};

/// None where the recordings have no row.
std::optional<Solved> solve(const MachineDescription& machine, std::span<const Motion> motions,
                            const FullOptions& options) {
  const RigidArm arm(machine);
  Rows rows(arm, measured_joints(machine), options);
  for (const Motion& motion : motions) rows.add(motion);
  if (rows.empty()) return {};
  Solved solved{rows.problem(), active_columns(machine, options), {}};
  LeastSquaresProblem& problem = solved.problem;
  problem.floor = column_noise(machine, options, motions.front().step_s, rows.mean_lever_m());
  problem.columns = Eigen::MatrixXd(problem.columns(Eigen::all, solved.active));
  problem.floor = Eigen::VectorXd(problem.floor(solved.active));
  solved.solution = solve_least_squares(problem, {.huber = options.huber, .rank_tolerance = kRankTolerance});
  return solved;
}

FullResult fit(const MachineDescription& machine, std::span<const Recording> recordings, const FullOptions& options) {
  FullResult result;
  Identification& summary = result.summary;
  summary.method = "full";
  summary.parameters = calibration_names();
  std::vector<Motion> motions;
  for (const Recording& recording : recordings) {
    motions.push_back(offline_motion(machine, recording, options.motion));
    summary.duration_s += motions.back().duration_s();
  }
  summary.reasons = excitation_faults(recordings, motions);

  const std::optional<Solved> solved = solve(machine, motions, options);
  if (!solved) return result;
  const std::vector<int>& active = solved->active;
  const LeastSquaresSolution& solution = solved->solution;
  summary.condition_number = solution.condition_number;
  summary.rank = solution.rank;
  summary.columns = static_cast<int>(active.size());
  summary.indistinct = indistinct_combinations(solution, names_of(summary.parameters, active));
  if (!summary.reasons.empty()) return result;
  for (const std::string& line : summary.indistinct) summary.reasons.push_back(line);
  judge_fit(solved->problem, solution, measured_joints(machine), summary.reasons);

  CalibrationVector& parameters = result.dynamics.parameters;
  parameters = kept_from_drawing(machine);
  parameters(active) = solution.parameters;
  result.sandwich_covariance = spread(solution.sandwich, active);
  const JointVector greatest_kg = greatest_mass_kg(machine);
  if (options.consistent && !physically_consistent(parameters, greatest_kg)) {
    parameters = nearest_consistent(parameters, spread(solution.information, active), greatest_kg);
    result.made_consistent = true;
  }
  fill(result, machine, options);
  summary.usable = summary.reasons.empty();
  if (result.made_consistent) summary.reasons.push_back("moved to the nearest parameters that an arm can have");
  if (machine.sensors.without_pressures != SensorDescription::kNone) summary.reasons.push_back(unseen_text(machine));
  return result;
}

/// Without the bounds of what an arm can be, which would hide how far parameters move; none where the recordings cannot
/// tell all of them, or where the machine is no machine any more.
std::optional<CalibrationVector> free_parameters(const FullInput& input) {
  try {
    std::vector<Motion> motions;
    for (const Recording& recording : input.recordings)
      motions.push_back(offline_motion(input.machine, recording, input.options.motion));
    const std::optional<Solved> solved = solve(input.machine, motions, input.options);
    if (!solved || solved->solution.unseen.cols() > 0) return {};
    CalibrationVector parameters = CalibrationVector::Zero();
    parameters(solved->active) = solved->solution.parameters;
    return parameters;
  } catch (const InputError&) {
    return {};
  }
}

/// Sum of the squares of what each usual error moves, in the summary. The calibration's own covariance stays: what a
/// sensor is off moves parameters so that it cancels where the same sensor is read again.
void widen(FullResult& result, const MachineDescription& machine, std::span<const Recording> recordings,
           const FullOptions& options) {
  constexpr double kCoarse_s = 0.02;  // coarse is enough for differences, and quick
  FullInput input{machine, {}, options};
  for (const Recording& recording : recordings) {
    input.recordings.push_back(thinned(recording, kCoarse_s));
  }
  const std::optional<CalibrationVector> unmoved = free_parameters(input);
  std::string left_out;
  CalibrationMatrix sum = CalibrationMatrix::Zero();
  for (const UsualError& error : usual_errors(machine)) {
    FullInput off = input;
    error.apply(off);
    const std::optional<CalibrationVector> moved = unmoved ? free_parameters(off) : std::nullopt;
    if (!moved) {
      left_out += (left_out.empty() ? "" : ", ") + error.name;
      continue;
    }
    CalibrationVector change = *moved - *unmoved;
    if (error.of == UsualError::Of::kModel) change.tail<kCalibrationCount - kBaseCount>().setZero();
    sum += change * change.transpose();
  }
  result.summary.sigmas = Identification::Sigmas::kWithUsualErrors;
  result.summary.covariance += sum;
  set_sigmas(result.summary);
  if (!left_out.empty())
    result.summary.reasons.push_back("standard deviations do not contain what these change: " + left_out);
}

}  // namespace

FullResult identify_full(const MachineDescription& machine, std::span<const Recording> recordings,
                         const FullOptions& options) {
  FullOptions used = options;
  FullResult result = fit(machine, recordings, used);
  if (!result.summary.indistinct.empty() && options.regressor.friction.seal) {
    // Short recordings cannot tell the seals' friction from breakaway: then it is left to the bias filter.
    used.regressor.friction.seal = false;
    FullResult fewer = fit(machine, recordings, used);
    if (!fewer.summary.usable) return result;
    result = std::move(fewer);
  }
  if (result.summary.usable && options.usual_errors && !options.model_error) widen(result, machine, recordings, used);
  return result;
}

TorqueComparison compare_torque(const DynamicsCalibration& dynamics, const MachineDescription& machine,
                                const Recording& recording, const FullOptions& options) {
  const Motion motion = offline_motion(machine, recording, options.motion);
  const RigidArm arm(machine);
  FrictionColumns columns = options.regressor.friction;
  columns.stribeck_mps = dynamics.stribeck_mps[0];
  const Eigen::MatrixXd friction = friction_signals(motion, columns).columns;
  Eigen::MatrixXd momentum = Eigen::MatrixXd::Zero(kJoints, motion.size()), rest = momentum;
  for (const Stretch& stretch : motion.stretches) {
    for (Eigen::Index n = stretch.first; n < stretch.end; ++n) {
      const Pose pose(motion.joint_rad.col(n), motion.hull_pitch_rad[n]);
      const JointVector rate = absolute(motion.joint_radps.col(n));
      momentum.col(n) = joint_torque(arm.momentum(pose, rate) * dynamics.base());
      rest.col(n) = joint_torque((arm.velocity_products(pose, rate) + RigidArm::gravity(pose)) * dynamics.base());
      for (int j = 0; j < kJoints; ++j) {
        rest(j, n) += motion.lever_m(j, n) *
                      friction.col(n)
                          .segment<kFrictionCount>(kFrictionCount * j)
                          .dot(dynamics.parameters.segment<kFrictionCount>(friction_index(j, kCoulombExtend)));
      }
    }
  }
  const int half = smoothing_half_window(options.motion, motion.step_s);
  const Eigen::MatrixXd inertia =
      filtered(momentum, savitzky_golay(half, options.motion.order, 1, motion.step_s), motion.stretches);
  TorqueComparison comparison = empty_comparison(motion);
  for (const Stretch& stretch : shortened(motion.stretches, half)) {
    for (Eigen::Index n = stretch.first; n < stretch.end; ++n) {
      const auto i = static_cast<std::size_t>(n);
      comparison.measured_Nm[i] = cylinder_torque(motion, n);
      comparison.modelled_Nm[i] = inertia.col(n) + rest.col(n);
      comparison.usable[i] = 1;
    }
  }
  return comparison;
}

}  // namespace knuckle::estimation
