#include "estimation/identification/kinematic_calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/symmetric_eigen.h"
#include "estimation/identification/survey_points.h"
#include "machine/description.h"

namespace knuckle::estimation {
namespace {

constexpr double kOutlier = 5;  // standard deviations of a point's whitened error, seen in each direction
constexpr double kMm = 1e3;
constexpr std::size_t kFolds = 4;  // of cross-validation: each pose is predicted by a fit that has not seen it

/// The k-th smallest of all, k as part of the whole.
double quantile(std::vector<double> values, double part) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1) + 0.5)];
}

TipError tip_error(const std::vector<double>& distances_m) {
  TipError error{distances_m.size(), 0, quantile(distances_m, 0.5), quantile(distances_m, 0.95)};
  for (const double d : distances_m) error.rms_m += d * d / static_cast<double>(distances_m.size());
  error.rms_m = std::sqrt(error.rms_m);
  return error;
}

double whitened_norm(const SurveyPoint& point, const GeometryVector& geometry, const LinkageSides& sides) {
  const auto error = point_error(point, geometry, sides);
  return error ? (point.whitening * *error).norm() : 1e9;
}

/// Marks what lies far off a robust fit; the scale is the errors' own where the survey's sigma is too small.
/// @return false where there is no fit.
bool mark_outliers(std::vector<SurveyPoint>& points, const GeometryPrior& prior, std::vector<std::string>& left_out) {
  const auto fit = fit_geometry(points, prior, true);
  if (!fit) return false;
  std::vector<double> norms;
  for (const SurveyPoint& p : points) norms.push_back(whitened_norm(p, *fit, prior.sides));
  const double scale = std::max(1.0, quantile(norms, 0.5) / 1.177);  // median of a Rayleigh distribution
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].used = norms[i] <= kOutlier * scale;
    if (points[i].used) continue;
    const auto error = point_error(points[i], *fit, prior.sides);
    left_out.push_back("pose " + std::to_string(points[i].pose) + ": " +
                       kPointNames[static_cast<std::size_t>(points[i].link)] +
                       fmt::format(" is {:.1f} mm off the position that the other points give ({:.0f} sigma)",
                                   error ? kMm * error->norm() : 0, norms[i]));
  }
  return true;
}

/// Tips of each fold as a fit without that fold predicts them.
std::optional<std::vector<double>> held_out_tips(const std::vector<SurveyPoint>& points, const GeometryPrior& prior) {
  std::vector<double> distances;
  for (std::size_t fold = 0; fold < kFolds; ++fold) {
    std::vector<SurveyPoint> training = points;
    for (SurveyPoint& p : training) p.used = p.used && p.pose % kFolds != fold;
    const auto fit = fit_geometry(training, prior, false);
    if (!fit) return std::nullopt;
    for (const SurveyPoint& p : points) {
      if (!p.used || p.link != kBucket || p.pose % kFolds != fold) continue;
      const auto error = point_error(p, *fit, prior.sides);
      if (!error) return std::nullopt;
      distances.push_back(error->norm());
    }
  }
  return distances;
}

/// Of the data alone, per prior standard deviation of each parameter.
GeometryMatrix information_of(const std::vector<SurveyPoint>& points, const GeometryVector& geometry,
                              const GeometryPrior& prior) {
  GeometryMatrix information = GeometryMatrix::Zero();
  for (const SurveyPoint& p : points) {
    if (!p.used) continue;
    const Eigen::Matrix<double, 2, kGeometryCount> rows =
        error_gradient(p, geometry, prior.sides) * prior.sigma.asDiagonal();
    information += rows.transpose() * rows;
  }
  return information;
}

/// A direction in which the drawing says more than the survey.
std::string in_words(const GeometryVector& direction, double left) {
  std::string words;
  const double largest = direction.cwiseAbs().maxCoeff();
  const double sign = direction[0] >= 0 ? 1 : -1;
  for (int i = 0; i < kGeometryCount; ++i) {
    if (std::abs(direction[i]) < 0.4 * largest) continue;
    const bool plus = sign * direction[i] > 0;
    words += (words.empty() ? (plus ? "" : "-") : (plus ? " + " : " - ")) +
             fmt::format("{:.1f} ", std::abs(direction[i])) + kGeometryNames[static_cast<std::size_t>(i)];
  }
  return words + fmt::format(": {:.0f} % of the drawing's uncertainty is left", 100 * left);
}

/// Parameters and covariance.
void tell(GeometryResult& result, const GeometryPrior& prior, const std::vector<SurveyPoint>& points,
          const GeometryVector& geometry) {
  Identification& summary = result.summary;
  const GeometryMatrix information = information_of(points, geometry, prior);
  double squares = (geometry - prior.mean).cwiseQuotient(prior.sigma).squaredNorm();
  double count = 0;  // the prior's 22 residuals and the 22 unknowns cancel
  for (const SurveyPoint& p : points) {
    if (!p.used) continue;
    squares += std::pow(whitened_norm(p, geometry, prior.sides), 2);
    count += 2;
  }
  result.residual_ratio = std::sqrt(squares / count);
  const double widened = std::max(1.0, result.residual_ratio * result.residual_ratio);
  const GeometryMatrix scaled = (information / widened + GeometryMatrix::Identity()).inverse();
  const GeometryMatrix covariance = prior.sigma.asDiagonal() * scaled * prior.sigma.asDiagonal();
  for (int i = 0; i < kGeometryCount; ++i) {
    summary.parameters.push_back({kGeometryNames[static_cast<std::size_t>(i)], "mm", kMm * geometry[i],
                                  kMm * std::sqrt(covariance(i, i)), false});
  }
  summary.covariance = kMm * kMm * covariance;
  const SymmetricEigen eigen = symmetric_eigen(information / widened);
  summary.columns = kGeometryCount;
  summary.rank = static_cast<int>((eigen.values.array() > 1).count());
  summary.condition_number = std::sqrt((1 + eigen.values[kGeometryCount - 1]) / (1 + std::max(0.0, eigen.values[0])));
  for (int i = 0; i < kGeometryCount - summary.rank; ++i) {
    summary.indistinct.push_back(in_words(eigen.vectors.col(i), 1 / std::sqrt(1 + std::max(0.0, eigen.values[i]))));
  }
}

GeometryResult refused(GeometryResult result, std::vector<std::string> reasons) {
  result.summary.usable = false;
  result.summary.reasons = std::move(reasons);
  return result;
}

}  // namespace

GeometryResult calibrate_geometry(const MachineDescription& nominal, const Survey& survey) {
  const GeometryPrior prior = geometry_prior(nominal);
  GeometryResult result;
  result.summary.method = "survey";
  result.geometry = to_calibration(prior.mean);
  SurveyPoints selected = select_points(nominal, survey);
  result.left_out = selected.left_out;
  if (!selected.refusals.empty()) return refused(std::move(result), selected.refusals);

  std::vector<SurveyPoint>& points = selected.points;
  if (!mark_outliers(points, prior, result.left_out)) return refused(std::move(result), {"the fit does not converge"});
  const auto used =
      static_cast<std::size_t>(std::count_if(points.begin(), points.end(), [](auto& p) { return p.used; }));
  if (4 * used < 3 * points.size()) {
    const std::string reason = std::to_string(points.size() - used) + " of " + std::to_string(points.size()) +
                               " points do not fit the others; " + result.left_out.back();
    return refused(std::move(result), {reason});
  }
  const auto fit = fit_geometry(points, prior, false);
  const auto held_out = held_out_tips(points, prior);
  if (!fit || !held_out) return refused(std::move(result), {"the fit does not converge"});
  tell(result, prior, points, *fit);
  try {
    (void)Kinematics(with_geometry(nominal, *fit));
  } catch (const InputError& error) {  // pins for which the working range cannot be reached
    return refused(std::move(result), {std::string("the fitted geometry is not a possible machine: ") + error.what()});
  }
  std::vector<double> nominal_m;
  for (const SurveyPoint& p : points) {
    if (p.used && p.link == kBucket) nominal_m.push_back(point_error(p, prior.mean, prior.sides).value().norm());
  }
  result.held_out = tip_error(*held_out);
  result.nominal = tip_error(nominal_m);
  result.geometry = to_calibration(*fit);
  result.geometry.tip_rms_m = result.held_out.rms_m;
  result.summary.usable = true;
  result.summary.reasons = result.left_out;
  if (result.residual_ratio > 2) {
    result.summary.reasons.push_back(
        fmt::format("points scatter {:.1f} times as far as the survey's sigma of {:.2f} mm; sigmas are scaled up",
                    result.residual_ratio, kMm * survey.point_sigma_m));
  }
  return result;
}

}  // namespace knuckle::estimation
