// Fit of the valve model, axis by axis.
#include "estimation/identification/valve_identification.h"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "machine/description.h"

namespace knuckle::estimation {
namespace {

constexpr double kMoves_mps = 0.005, kLeastMoving_s = 2;
constexpr double kOffset_Pa = 0.6e5;   ///< Trust in a pressure: transmitters are within 1 bar.
constexpr double kSmallDrop_Pa = 3e5;  ///< Below it a sample counts less.
/// What the model leaves out (spool frequency +- 15 %, hysteresis, the orifice's laminar part), as sampled machines
/// show it.
const std::array<double, 4> kModelError{8e-4, 8e-4, 4e-3, 0.01};  // dead bands, delay [s], gain (relative)
/// The same where the load is the arm's weight alone.
const std::array<double, 4> kWeighedError{5e-3, 5e-3, 8e-3, 0.1};
/// Straight edges that are alike are the rule: RMS of their misfit over RMS of the speed above which a curve is fitted;
/// and of a curve's, above which a notch is looked for.
constexpr double kStraightFit = 0.02, kCurvedFit = 0.01;
/// A curve is believed that leaves at most this part of that misfit, a notch of the curve's.
constexpr double kCurvedGain = 0.7;
constexpr double kNotchPassed = 0.1;     ///< Opening beyond a notch that commands have to reach.
constexpr double kLeastDeadBand = 0.25;  ///< Of the file's: a fit with less has taken something else for the edges.
constexpr double kWorstFit = 0.15;       ///< RMS of the misfit over RMS of the speed: worse is no valve of this kind.

/// One residual per filtered speed, then the trust in the file's values: in units of the residuals' sigma, as they
/// count once their neighbours' share is taken off.
class Misfit {
 public:
  Misfit(const AxisModel& model, const std::vector<AxisStretch>& stretches, ValveVector file, int fitted,
         double speed_rms_mps, double sigma)
      : model_(model),
        stretches_(stretches),
        file_(std::move(file)),
        fitted_(fitted),
        scale_mps_(0.05 * speed_rms_mps),
        sigma_(sigma) {
    for (const AxisStretch& axis : stretches_) count_ += model_.speeds(axis, file_).measured_mps.size();
  }
  static constexpr int kPriors = 2;
  [[nodiscard]] int count() const { return static_cast<int>(count_ + kPriors); }

  bool operator()(double const* const* parameters, double* residuals) const {
    const ValveVector p = in_units(parameters[0]);
    double* at = residuals;
    for (const AxisStretch& axis : stretches_) {
      const AxisSpeeds s = model_.speeds(axis, p);
      for (std::size_t i = 0; i < s.measured_mps.size(); ++i) {
        const double trust = std::min(1.0, s.least_drop_Pa[i] / kSmallDrop_Pa);
        const double misfit = trust * (s.modelled_mps[i] - s.measured_mps[i]) / scale_mps_;
        *at++ = std::copysign(std::sqrt(huber(misfit)), misfit);
      }
    }
    *at++ = sigma_ * p[kHeadOffset] / kOffset_Pa;
    *at++ = sigma_ * p[kRodOffset] / kOffset_Pa;
    return true;
  }
  /// Units in which all parameters are near one.
  [[nodiscard]] ValveVector scales() const {
    ValveVector s;
    s << 0.1, 0.1, 0.02, file_[kGain], 1e5, 1e5, 1, 1, 1, 1;
    return s;
  }
  /// The first `fitted`; the others are the file's.
  [[nodiscard]] ValveVector in_units(const double* fitted) const {
    ValveVector p = file_;
    const Eigen::Map<const Eigen::VectorXd> some(fitted, fitted_);
    p.head(fitted_) = some.cwiseProduct(scales().head(fitted_));
    return p;
  }

 private:
  static double huber(double r) {
    constexpr double kBound = 1.5;
    const double size = std::abs(r);
    return size <= kBound ? r * r : kBound * (2 * size - kBound);
  }

  const AxisModel& model_;
  const std::vector<AxisStretch>& stretches_;
  ValveVector file_;
  int fitted_;
  double scale_mps_, sigma_;
  std::size_t count_ = 0;
};

struct Fit {
  ValveVector parameters;
  Eigen::MatrixXd covariance;  ///< Of those fitted.
  double sigma = 1;            ///< Of a residual, neighbours' share taken off.
  bool converged = false;
};

/// How many neighbouring residuals count as one: 1 + 2 sum of autocorrelations while these are positive.
double correlated_residuals(const Eigen::VectorXd& residuals) {
  const double power = residuals.squaredNorm();
  double sum = 1;
  for (Eigen::Index lag = 1; lag < std::min<Eigen::Index>(100, residuals.size()); ++lag) {
    const double shared = residuals.head(residuals.size() - lag).dot(residuals.tail(residuals.size() - lag)) / power;
    if (!(shared > 0)) break;
    sum += 2 * shared;
  }
  return sum;
}

Fit fit(const AxisModel& model, const std::vector<AxisStretch>& stretches, const ValveVector& file,
        const ValveVector& start, int fitted, double speed_rms_mps, double sigma) {
  auto* misfit = new Misfit(model, stretches, file, fitted, speed_rms_mps, sigma);  // Ceres owns it
  const Eigen::VectorXd scales = misfit->scales().head(fitted);
  const int count = misfit->count();
  ceres::NumericDiffOptions steps;
  steps.relative_step_size = 1e-3;  // play and dead bands have kinks
  auto* cost = new ceres::DynamicNumericDiffCostFunction<Misfit, ceres::CENTRAL>(misfit, ceres::TAKE_OWNERSHIP, steps);
  cost->AddParameterBlock(fitted);
  cost->SetNumResiduals(count);
  Eigen::VectorXd x = start.head(fitted).cwiseQuotient(scales);
  ceres::Problem problem;
  problem.AddResidualBlock(cost, nullptr, x.data());
  const auto bound = [&](ValveParameter which, double low, double high) {
    if (which >= fitted) return;
    problem.SetParameterLowerBound(x.data(), which, low / scales[which]);
    problem.SetParameterUpperBound(x.data(), which, high / scales[which]);
  };
  bound(kDeadExtend, 0, 0.6);
  bound(kDeadRetract, 0, 0.6);
  bound(kDelay, 0, 0.3);
  bound(kGain, 0.05 * file[kGain], 20 * file[kGain]);
  bound(kExponent, 0.6, 3.5);
  bound(kRetractShare, 0.2, 5);
  bound(kNotchOpening, 0.1, 0.9);
  bound(kNotchSlope, 0.1, 1);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = 40;
  options.function_tolerance = 1e-7;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);

  Fit result;
  result.parameters = misfit->in_units(x.data());
  result.converged = summary.IsSolutionUsable();
  Eigen::VectorXd residuals(count);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> jacobian(count, fitted);
  const double* block = x.data();
  double* rows = jacobian.data();
  cost->Evaluate(&block, residuals.data(), &rows);
  const Eigen::VectorXd misfits = residuals.head(count - Misfit::kPriors);
  const double variance = misfits.squaredNorm() / static_cast<double>(misfits.size()) * correlated_residuals(misfits);
  result.sigma = std::sqrt(variance);
  result.covariance =
      scales.asDiagonal() * (variance * (jacobian.transpose() * jacobian).inverse()) * scales.asDiagonal();
  return result;
}

std::string text(double value) {
  return fmt::format("{:.3g}", value);
}

/// What the data hold, before any fit.
struct Coverage {
  double extending_s = 0, retracting_s = 0, duration_s = 0, speed_rms_mps = 0, largest_command = 0;
};

Coverage coverage(const AxisModel& model, const std::vector<AxisStretch>& stretches, const ValveVector& start) {
  Coverage found;
  double squares = 0;
  std::size_t count = 0;
  for (const AxisStretch& axis : stretches) {
    found.duration_s += axis.step_s * static_cast<double>(axis.command.size());
    for (const double command : axis.command)
      found.largest_command = std::max(found.largest_command, std::abs(command));
    for (const double speed : model.speeds(axis, start).measured_mps) {
      (speed > 0 ? found.extending_s : found.retracting_s) += std::abs(speed) >= kMoves_mps ? kValveEvery_s : 0;
      squares += speed * speed;
      ++count;
    }
  }
  found.speed_rms_mps = count > 0 ? std::sqrt(squares / static_cast<double>(count)) : 0;
  return found;
}

double relative_misfit(const AxisModel& model, const std::vector<AxisStretch>& stretches, const ValveVector& parameters,
                       double speed_rms_mps) {
  double squares = 0;
  std::size_t count = 0;
  for (const AxisStretch& axis : stretches) {
    const AxisSpeeds s = model.speeds(axis, parameters);
    for (std::size_t i = 0; i < s.measured_mps.size(); ++i) {
      squares += (s.measured_mps[i] - s.modelled_mps[i]) * (s.measured_mps[i] - s.modelled_mps[i]);
      ++count;
    }
  }
  return std::sqrt(squares / static_cast<double>(count)) / speed_rms_mps;
}

/// Commands went well beyond the notch, on both sides: else nothing tells where it ends.
bool notch_was_passed(const ValveVector& p, double largest_command) {
  const double dead_band = std::max(p[kDeadExtend], p[kDeadRetract]);
  return (largest_command - dead_band) / (1 - dead_band) > p[kNotchOpening] + kNotchPassed;
}

/// Why the data cannot show a valve; empty where they can.
std::vector<std::string> refusals(const std::string& name, const Coverage& found) {
  std::vector<std::string> reasons;
  const auto moved = [&](double seconds, const char* way) {
    if (seconds >= kLeastMoving_s) return;
    reasons.push_back(name + ": " + way + " for " + text(seconds) + " s at " + text(1e3 * kMoves_mps) +
                      " mm/s or more, at least " + text(kLeastMoving_s) + " s are needed");
  };
  if (found.duration_s == 0) {
    reasons.push_back(name + ": no stretch of " + text(4 * kValveSettle_s) + " s or more with valve commands");
    return reasons;
  }
  if (found.largest_command == 0) reasons.push_back(name + ": valve commands are all zero");
  moved(found.extending_s, "extending");
  moved(found.retracting_s, "retracting");
  return reasons;
}

Identification identify_axis(const MachineDescription& machine, int joint, std::span<const Recording> recordings,
                             ValveCalibration& valve) {
  const auto k = static_cast<std::size_t>(joint);
  const std::string name = kJointNames[k];
  const ValveVector start = valve_vector(machine.cylinders[k].valve);
  valve = valve_calibration(start);
  const AxisModel model(machine, k);
  const std::vector<AxisStretch> stretches = axis_stretches(machine, recordings, joint);
  const Coverage found = coverage(model, stretches, start);
  Identification result;
  result.method = "valves";
  result.duration_s = found.duration_s;
  result.reasons = refusals(name, found);
  if (!result.reasons.empty()) return result;

  const auto fitted = [&](int count, const ValveVector& from) {
    const Fit first = fit(model, stretches, start, from, count, found.speed_rms_mps, 1);
    return fit(model, stretches, start, first.parameters, count, found.speed_rms_mps, first.sigma);
  };
  const auto misfit_of = [&](const Fit& fit) {
    return relative_misfit(model, stretches, fit.parameters, found.speed_rms_mps);
  };
  Fit best = fitted(kStraight, start);
  const bool weighed = !stretches.empty() && stretches.front().weighed;
  if (!weighed && (!best.converged || !(misfit_of(best) <= kStraightFit))) {
    // From straight edges and from as curved ones as there are: the misfit has a valley at each end.
    ValveVector steep = start;
    steep[kExponent] = 2;
    const auto prefer = [&](const Fit& other, double bound) {
      if (other.converged && other.covariance.allFinite() && misfit_of(other) < std::min(bound, misfit_of(best)))
        best = other;
    };
    const double curved_bound = kCurvedGain * misfit_of(best);
    for (const Fit& curved : {fitted(kCurved, best.parameters), fitted(kCurved, steep)}) prefer(curved, curved_bound);
    // A curve alone fits a notch with wrong dead bands, at a misfit that may be small.
    const double notch_bound = kCurvedGain * misfit_of(best);
    ValveVector notched = best.parameters;
    notched.head(kDelay) = start.head(kDelay);
    notched[kExponent] = 1.2;
    notched[kNotchSlope] = 0.6;
    for (const double notch_opening : {0.5, 0.3, 0.8}) {
      if (misfit_of(best) <= kCurvedFit) break;
      notched[kNotchOpening] = notch_opening;
      if (!notch_was_passed(notched, found.largest_command)) continue;
      const Fit found_notch = fitted(kAll, notched);
      if (notch_was_passed(found_notch.parameters, found.largest_command)) prefer(found_notch, notch_bound);
    }
  }
  const double misfit = misfit_of(best);
  result.covariance = best.covariance;
  result.rank = result.columns = static_cast<int>(best.covariance.rows());
  for (const ValveParameter which : {kDeadExtend, kDeadRetract, kDelay, kGain}) {
    const double model_error =
        (weighed ? kWeighedError : kModelError)[which] * (which == kGain ? best.parameters[kGain] : 1);
    result.covariance(which, which) += model_error * model_error;
  }
  const std::array<std::pair<const char*, const char*>, kAll> names{{{"dead_band_extend", ""},
                                                                     {"dead_band_retract", ""},
                                                                     {"delay", "s"},
                                                                     {"nominal_flow", "m^3/s"},
                                                                     {"head_pressure_offset", "Pa"},
                                                                     {"rod_pressure_offset", "Pa"},
                                                                     {"curve_exponent", ""},
                                                                     {"retract_share", ""},
                                                                     {"notch_opening", ""},
                                                                     {"notch_slope", ""}}};
  for (Eigen::Index at = 0; at < result.covariance.rows(); ++at) {
    const auto i = static_cast<std::size_t>(at);
    result.parameters.push_back(
        {names[i].first, names[i].second, best.parameters[at], std::sqrt(result.covariance(at, at)), false});
  }
  if (weighed)
    result.reasons.push_back(name + ": its pressures are not measured: flow at the load of the arm's weight; no curve");
  result.reasons.push_back(name + ": commands to " + text(found.largest_command) +
                           " of the spool's stroke; nothing is known beyond");
  if (!best.converged || !(misfit <= kWorstFit)) {
    result.reasons.insert(result.reasons.begin(), name + ": the valve model misses the speed by " + text(100 * misfit) +
                                                      " % RMS, limit " + text(100 * kWorstFit) + " %");
    return result;
  }
  for (const ValveParameter which : {kDeadExtend, kDeadRetract}) {
    if (best.parameters[which] >= kLeastDeadBand * start[which]) continue;
    result.reasons.insert(result.reasons.begin(), name + ": the best fit has a dead band of " +
                                                      text(best.parameters[which]) + ", the machine file " +
                                                      text(start[which]) +
                                                      ": not believed; if it is true, correct the file");
    return result;
  }
  result.usable = true;
  valve = valve_calibration(best.parameters);
  return result;
}

}  // namespace

ValveResult identify_valves(const MachineDescription& machine, std::span<const Recording> recordings) {
  ValveResult result;
  for (int joint = 0; joint < kJoints; ++joint) {
    const auto k = static_cast<std::size_t>(joint);
    result.axes[k] = identify_axis(machine, joint, recordings, result.valves[k]);
  }
  return result;
}

}  // namespace knuckle::estimation
