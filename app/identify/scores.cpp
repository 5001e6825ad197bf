#include "app/identify/scores.h"

#include <algorithm>

#include "estimation/friction.h"
#include "estimation/identification/filtered_regressor.h"

namespace knuckle::identify {
namespace {

constexpr double kTwoSided95 = 1.96;
constexpr double kMoving_mps = 5e-3;                // below it friction is whatever holds the rod
constexpr int kSpeedBins = 15, kLeastSamples = 50;  // of the friction curve, each way
constexpr double kSpeedBin_mps = 0.01;
constexpr double kRidge = 1e-6;  // Coulomb, breakaway and load share are nearly one column

using FrictionRow = Eigen::Matrix<double, kFrictionCount, 1>;
using FrictionMatrix = Eigen::Matrix<double, kFrictionCount, kFrictionCount>;

/// What stands between pressures and the rod, and the model's columns for it, where the rod moves.
struct FrictionSample {
  double force_N;
  FrictionRow columns;
};

void collect(const MachineDescription& machine, double stribeck_mps, const motion::MachineRecording& run, int joint,
             std::vector<FrictionSample>& samples) {
  const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(joint)];
  estimation::DahlState dahl;
  const auto side = static_cast<std::size_t>(2 * joint);
  for (std::size_t k = 0; k < run.truth.size(); ++k) {
    const motion::TruthSample& truth = run.truth[k];
    const auto& pressure = run.recording.samples[k].pressure_Pa;
    const bool is_measured = run.recording.samples[k].pressures_known[static_cast<std::size_t>(joint)];
    const double measured_N =
        is_measured ? pressure[side] * cylinder.head_area_m2() - pressure[side + 1] * cylinder.rod_side_area_m2()
                    : truth.cylinder_N[joint];
    const double speed = truth.cylinder_mps[joint];
    const double bristle = dahl.step(speed, run.recording.step_s);
    if (std::abs(speed) < kMoving_mps) continue;
    const double slip = speed / stribeck_mps;
    FrictionRow row;
    row[kCoulombExtend] = (1 + bristle) / 2;
    row[kCoulombRetract] = (bristle - 1) / 2;
    row[kViscous] = speed;
    row[kBreakaway] = bristle * std::exp(-slip * slip);
    row[kLoadShare] = bristle * std::abs(measured_N);
    row[kSeal] = bristle * std::max(0.0, pressure[side] + pressure[side + 1]);
    samples.push_back({truth.friction_N[joint] + measured_N - truth.cylinder_N[joint], row});
  }
}

FrictionRow fitted(const std::vector<FrictionSample>& samples) {
  FrictionMatrix normal = FrictionMatrix::Zero();
  FrictionRow right = FrictionRow::Zero();
  for (const FrictionSample& s : samples) {
    normal += s.columns * s.columns.transpose();
    right += s.columns * s.force_N;
  }
  normal.diagonal() *= 1 + kRidge;
  return normal.ldlt().solve(right);
}

/// Mean of a curve's samples of about one speed.
struct CurvePoint {
  double truth_N = 0, error_N = 0;
  int samples = 0;
};

double rms_without_mean(const std::vector<CurvePoint>& curve, double CurvePoint::*value) {
  double sum = 0, squares = 0, n = 0;
  for (const CurvePoint& point : curve) {
    if (point.samples < kLeastSamples) continue;
    const double v = point.*value / point.samples;
    sum += v;
    squares += v * v;
    ++n;
  }
  return std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n)));
}

/// Friction over speed: truth and model, each averaged over the samples of one speed, so that pressure noise and the
/// bristles' swing do not count.
double friction_error(const MachineDescription& machine, const CommissionRuns& runs, const DynamicsCalibration& found,
                      int joint) {
  std::vector<FrictionSample> samples;
  for (const motion::MachineRecording* run : {&runs.validation_slow, &runs.validation_digging}) {
    collect(machine, found.stribeck_mps[joint], *run, joint, samples);
  }
  const FrictionRow parameters = found.parameters.segment<kFrictionCount>(friction_index(joint, kCoulombExtend));
  std::vector<CurvePoint> curve(2 * kSpeedBins);
  for (const FrictionSample& s : samples) {
    const auto bin = static_cast<std::size_t>(
        std::clamp(s.columns[kViscous] / kSpeedBin_mps + kSpeedBins, 0.0, 2.0 * kSpeedBins - 1));
    CurvePoint& point = curve[bin];
    point.truth_N += s.force_N;
    point.error_N += s.columns.dot(parameters) - s.force_N;
    ++point.samples;
  }
  return rms_without_mean(curve, &CurvePoint::error_N) / rms_without_mean(curve, &CurvePoint::truth_N);
}

}  // namespace

CalibrationVector true_parameters(const MachineDescription& machine, const CommissionRuns& runs,
                                  const DynamicsCalibration& found, double hull_pitch_rad) {
  std::vector<estimation::DynamicState> states;
  for (const motion::MachineRecording* run : {&runs.validation_slow, &runs.validation_digging}) {
    for (const motion::TruthSample& t : run->truth) {
      states.push_back({t.joint_rad, t.joint_radps, t.joint_radps2, hull_pitch_rad, t.lever_m,
                        t.lever_m.cwiseProduct(t.cylinder_N - t.friction_N)});
    }
  }
  CalibrationVector truth;
  truth.head<kBaseCount>() = estimation::project(machine, states);
  for (int joint = 0; joint < kJoints; ++joint) {
    std::vector<FrictionSample> samples;
    collect(machine, found.stribeck_mps[joint], runs.slow, joint, samples);
    collect(machine, found.stribeck_mps[joint], runs.fast, joint, samples);
    truth.segment<kFrictionCount>(friction_index(joint, kCoulombExtend)) = fitted(samples);
  }
  return truth;
}

ParameterScores score_parameters(const MachineDescription& machine, const CommissionRuns& runs,
                                 const DynamicsCalibration& found, const Eigen::MatrixXd& covariance,
                                 double hull_pitch_rad) {
  using estimation::kInertia, estimation::kMomentX, estimation::kMomentZ;
  const CalibrationVector truth = true_parameters(machine, runs, found, hull_pitch_rad);
  const CalibrationVector error = found.parameters - truth;
  ParameterScores scores;
  for (int i = 0; i < kJoints; ++i) {
    scores.gravity[i] =
        std::hypot(error[kMomentX + i], error[kMomentZ + i]) / std::hypot(truth[kMomentX + i], truth[kMomentZ + i]);
    scores.inertia[i] = std::abs(error[kInertia + i] / truth[kInertia + i]);
    scores.friction[i] = friction_error(machine, runs, found, i);
  }
  for (int p = 0; p < kBaseCount; ++p) {
    ++scores.intervals;
    scores.covered += std::abs(error[p]) <= kTwoSided95 * std::sqrt(covariance(p, p)) ? 1 : 0;
  }
  return scores;
}

namespace {

constexpr double kCutoff_Hz = 2;

std::vector<std::string> objections_of(std::span<const HoldOut> held_out, bool must_be_judged, int joint) {
  const std::string name = kJointNames[static_cast<std::size_t>(joint)];
  std::vector<std::string> reasons;
  bool judged = false, constant = false;
  for (const HoldOut& held : held_out) {
    const double nrmse = held.judged().nrmse[joint];
    constant = constant || (!std::isfinite(nrmse) && std::isfinite(held.judged().rms_Nm[joint]));
    if (!std::isfinite(nrmse)) continue;
    judged = true;
    if (nrmse <= kWorstNrmse) continue;
    reasons.push_back(held.source + ": torque error " + std::to_string(std::lround(100 * nrmse)) +
                      " % of the held-out torque of the " + name + " (RMS over standard deviation), limit " +
                      std::to_string(std::lround(100 * kWorstNrmse)) + " %");
  }
  if (!judged && (must_be_judged || constant))
    reasons.push_back("the " + name + " cannot be validated: " +
                      (constant ? "its held-out torque never changes" : "no held-out recording covers it"));
  return reasons;
}

}  // namespace

HoldOut held_out(const std::string& source, const std::string& method, const estimation::TorqueComparison& comparison) {
  return {source, method, estimation::torque_fit(comparison, kCutoff_Hz), estimation::torque_fit(comparison, 0)};
}

std::vector<std::string> objections(std::span<const HoldOut> held, const PerJoint<bool>& must_be_judged) {
  const bool validated = std::any_of(held.begin(), held.end(),
                                     [](const HoldOut& one) { return one.judged().nrmse.array().isFinite().any(); });
  if (!validated) return {"there is no held-out recording that could validate it"};
  std::vector<std::string> reasons;
  for (int j = 0; j < kJoints; ++j) {
    for (std::string& reason : objections_of(held, must_be_judged[static_cast<std::size_t>(j)], j))
      reasons.push_back(std::move(reason));
  }
  return reasons;
}

}  // namespace knuckle::identify
