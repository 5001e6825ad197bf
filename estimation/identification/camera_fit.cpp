#include "estimation/identification/camera_fit.h"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

namespace knuckle::estimation {
namespace {

constexpr double kClick_px = 1.5;    // nobody clicks better, however well six clicks happen to fit
constexpr double kMostDrawn_px = 8;  // standard deviation of where the tip is drawn, in a picture of 1280 across
constexpr double kUsual_px = 1280;
constexpr double kMostResidual_px = 25;  // likewise
constexpr double kDegrees = 180 / std::numbers::pi;
// Places among the unknowns; position from kX on.
constexpr int kX = 0, kY = 1, kZ = 2, kPan = 3, kTilt = 4, kField = 5, kUnknowns = 6;
using Unknowns = std::array<double, kUnknowns>;

/// What is clicked minus where the tip is seen; square pixels, the middle of the picture is the lens's axis.
struct PixelError {
  TipSight sight;
  double width_px, height_px;

  template <typename T>
  bool operator()(const T* u, T* error) const {
    using std::cos, std::sin, std::tan;
    const T cp = cos(u[kPan]), sp = sin(u[kPan]), ct = cos(u[kTilt]), st = sin(u[kTilt]);
    const T dx = T(sight.tip_m.x()) - u[kX], dy = -u[kY], dz = T(sight.tip_m.y()) - u[kZ];
    const T level = cp * dx + sp * dy;  // along the horizontal direction of view
    const T ahead = ct * level + st * dz;
    if (!(ahead > T(1e-3))) return false;
    const T right = sp * dx - cp * dy, up = ct * dz - st * level;
    const T focal = T(0.5 * width_px) / tan(0.5 * u[kField]);
    error[0] = T(0.5 * width_px) + focal * right / ahead - T(sight.pixel.x());
    error[1] = T(0.5 * height_px) - focal * up / ahead - T(sight.pixel.y());
    return true;
  }
};

Unknowns unknowns_of(const CameraDescription& c) {
  return {c.position_m.x(), c.position_m.y(), c.position_m.z(), c.pan_rad, c.tilt_rad, c.field_of_view_rad};
}

struct FittedCamera {
  double cost = 0;
  Unknowns unknowns{};
  Eigen::MatrixXd columns;  // of the Jacobian
  std::vector<double> errors;
};

std::optional<FittedCamera> solve(const std::vector<TipSight>& sights, Unknowns u, int width_px, int height_px) {
  ceres::Problem problem;
  for (const TipSight& sight : sights)
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PixelError, 2, kUnknowns>(
                                 new PixelError{sight, static_cast<double>(width_px), static_cast<double>(height_px)}),
                             nullptr, u.data());
  problem.SetParameterLowerBound(u.data(), kField, 5 / kDegrees);
  problem.SetParameterUpperBound(u.data(), kField, 150 / kDegrees);
  problem.SetParameterLowerBound(u.data(), kTilt, -89 / kDegrees);
  problem.SetParameterUpperBound(u.data(), kTilt, 89 / kDegrees);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = 300;
  options.function_tolerance = options.parameter_tolerance = 1e-12;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) return std::nullopt;
  FittedCamera solved{2 * summary.final_cost, u, {}, {}};
  ceres::CRSMatrix jacobian;
  problem.Evaluate({}, nullptr, &solved.errors, nullptr, &jacobian);
  solved.columns = Eigen::MatrixXd::Zero(jacobian.num_rows, jacobian.num_cols);
  for (int row = 0; row < jacobian.num_rows; ++row)
    for (int at = jacobian.rows[static_cast<std::size_t>(row)]; at < jacobian.rows[static_cast<std::size_t>(row) + 1];
         ++at)
      solved.columns(row, jacobian.cols[static_cast<std::size_t>(at)]) = jacobian.values[static_cast<std::size_t>(at)];
  return solved;
}

/// The best from where the file says it is, and from where cameras usually are.
std::optional<FittedCamera> best(const std::vector<TipSight>& sights, const CameraDescription& start, int width_px,
                                 int height_px) {
  std::vector<Unknowns> starts{unknowns_of(start)};
  for (const double side : {-0.6, 0.6})
    for (const double pan : {-0.5, 0.0, 0.5})
      for (const double tilt : {-0.8, -0.3}) starts.push_back({-0.3, side, 1.5, pan, tilt, 1.1});
  std::optional<FittedCamera> found;
  for (const Unknowns& from : starts) {
    auto solved = solve(sights, from, width_px, height_px);
    if (solved && (!found || solved->cost < found->cost)) found = std::move(solved);
  }
  return found;
}

CameraFit refused(const CameraDescription& start, std::string why) {
  CameraFit fit;
  fit.camera = start;
  fit.refused = std::move(why);
  return fit;
}

/// How far off a tip may be drawn; nullopt where it is not in the picture.
std::optional<double> drawn_sd_px(const FittedCamera& solved, const Eigen::MatrixXd& covariance,
                                  const PlanarVector& tip_m, int width_px, int height_px) {
  const ceres::AutoDiffCostFunction<PixelError, 2, kUnknowns> pixel(
      new PixelError{{tip_m, Eigen::Vector2d::Zero()}, static_cast<double>(width_px), static_cast<double>(height_px)});
  Eigen::Vector2d at;
  Eigen::Matrix<double, 2, kUnknowns, Eigen::RowMajor> rates;
  const double* unknowns = solved.unknowns.data();
  double* columns = rates.data();
  if (!pixel.Evaluate(&unknowns, at.data(), &columns)) return std::nullopt;
  if (at.minCoeff() < 0 || at.x() > width_px || at.y() > height_px) return std::nullopt;
  return std::sqrt((rates * covariance * rates.transpose()).trace());
}

/// Fills in how well the picture will be drawn over: where the tip was clicked, and in the arm's plane from close in to
/// far out, low to high. @return why that cannot be known; empty: it is.
std::string look_around(CameraFit& fit, const FittedCamera& solved, const std::vector<TipSight>& sights,
                        double error_px, int width_px, int height_px, double reach_m) {
  const Eigen::FullPivLU<Eigen::MatrixXd> normal(solved.columns.transpose() * solved.columns);
  if (!normal.isInvertible())
    return "these poses do not tell where the camera is; click the tip far out, close in, high and low";
  const Eigen::MatrixXd covariance = error_px * error_px * normal.inverse();
  const auto look = [&](const PlanarVector& tip_m) {
    const auto sd_px = drawn_sd_px(solved, covariance, tip_m, width_px, height_px);
    fit.drawn_sd_px = std::max(fit.drawn_sd_px, sd_px.value_or(0));
    return sd_px.has_value();
  };
  for (const TipSight& sight : sights) (void)look(sight.tip_m);
  bool seen = false;
  for (const double x : {0.45, 0.6, 0.75, 0.9})
    for (const double z : {-0.22, -0.1, 0.0, 0.1, 0.25}) seen |= look(reach_m * PlanarVector(x, z));
  if (seen) return {};
  return "by these clicks the camera would not see where the tip works: was the tip clicked, in each pose anew?";
}

std::string doubt(const CameraFit& fit, int width_px) {
  const double most_residual_px = kMostResidual_px * width_px / kUsual_px;
  if (fit.rms_px > most_residual_px)
    return fmt::format(
        "the clicks contradict each other by {:.0f} px (at most {:.0f}): was the tip's middle clicked each time, with "
        "the machine at rest, and does the machine's file fit?",
        fit.rms_px, most_residual_px);
  const double most_px = kMostDrawn_px * width_px / kUsual_px;
  if (fit.drawn_sd_px > most_px)
    return fmt::format(
        "these poses do not tell where the camera is: elsewhere the tip would be drawn wrong by {:.0f} px, standard "
        "deviation (at most {:.0f}); click it also far out, close in, high and low",
        fit.drawn_sd_px, most_px);
  return {};
}

}  // namespace

CameraFit fit_camera(const std::vector<TipSight>& sights, const CameraDescription& start, int width_px, int height_px,
                     double reach_m) {
  if (sights.size() < kLeastTipSights)
    return refused(start, fmt::format("{} of at least {} poses", sights.size(), kLeastTipSights));
  const std::optional<FittedCamera> solved = best(sights, start, width_px, height_px);
  if (!solved)
    return refused(start, "no place of the camera fits these clicks: was the tip clicked, in each pose anew?");
  CameraFit fit;
  fit.camera = start;
  const Unknowns& u = solved->unknowns;
  fit.camera.position_m = {u[kX], u[kY], u[kZ]};
  fit.camera.pan_rad = std::remainder(u[kPan], 2 * std::numbers::pi);
  fit.camera.tilt_rad = u[kTilt];
  fit.camera.field_of_view_rad = u[kField];
  for (std::size_t i = 0; i < sights.size(); ++i)
    fit.residual_px.push_back(std::hypot(solved->errors[2 * i], solved->errors[2 * i + 1]));
  const double count = static_cast<double>(sights.size());
  fit.rms_px = std::sqrt(solved->cost / count);
  const double freedom = std::max(1.0, 2 * count - kUnknowns);
  const double error_px = std::max(kClick_px * width_px / kUsual_px, std::sqrt(solved->cost / freedom));
  const std::string unknown = look_around(fit, *solved, sights, error_px, width_px, height_px, reach_m);
  fit.refused = doubt(fit, width_px);
  if (fit.refused.empty()) fit.refused = unknown;
  return fit;
}

std::string camera_block(const CameraFit& fit) {
  const CameraDescription& c = fit.camera;
  return fmt::format(
      "[[camera]]  # from {} clicks on the bucket's tip, residual {:.1f} px\n"
      "name = \"{}\"\n"
      "position_m = [{:.3f}, {:.3f}, {:.3f}]\n"
      "pan_deg = {:.2f}\n"
      "tilt_deg = {:.2f}\n"
      "field_of_view_deg = {:.2f}\n",
      fit.residual_px.size(), fit.rms_px, c.name, c.position_m.x(), c.position_m.y(), c.position_m.z(),
      kDegrees * c.pan_rad, kDegrees * c.tilt_rad, kDegrees * c.field_of_view_rad);
}

}  // namespace knuckle::estimation
