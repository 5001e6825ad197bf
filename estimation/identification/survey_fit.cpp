#include "estimation/identification/survey_fit.h"

#include <ceres/ceres.h>

#include <algorithm>

#include "machine/description.h"

namespace knuckle::estimation {
namespace {

/// Whitened error of one point, for automatic differentiation.
struct PointError {
  SurveyPoint point;
  LinkageSides sides;

  template <typename T>
  bool operator()(const T* geometry, T* residual) const {
    std::array<detail::Pin<T>, kJoints> points;
    if (!survey_points(geometry, point.reading_m, sides, points)) return false;
    const detail::Pin<T>& at = points[static_cast<std::size_t>(point.link)];
    const T dx = at.x() - point.at_m.x(), dz = at.y() - point.at_m.y();
    residual[0] = point.whitening(0, 0) * dx + point.whitening(0, 1) * dz;
    residual[1] = point.whitening(1, 0) * dx + point.whitening(1, 1) * dz;
    return true;
  }
};

using PointCost = ceres::AutoDiffCostFunction<PointError, 2, kGeometryCount>;

struct PriorError {
  GeometryPrior prior;
  template <typename T>
  bool operator()(const T* geometry, T* residual) const {
    for (int i = 0; i < kGeometryCount; ++i) residual[i] = (geometry[i] - prior.mean[i]) / prior.sigma[i];
    return true;
  }
};

}  // namespace

GeometryPrior geometry_prior(const MachineDescription& nominal, const GeometryOptions& options) {
  GeometryPrior prior{geometry_of(nominal), GeometryVector::Constant(options.pin_sigma_m), sides_of(nominal)};
  prior.sigma[kRockerLength] = prior.sigma[kCouplerLength] = options.rod_sigma_m;
  prior.sigma.segment<kJoints>(kEncoderOffset).setConstant(options.encoder_offset_sigma_m);
  return prior;
}

std::optional<PlanarVector> point_error(const SurveyPoint& point, const GeometryVector& geometry,
                                        const LinkageSides& sides) {
  std::array<PlanarVector, kJoints> points;
  if (!survey_points(geometry.data(), point.reading_m, sides, points)) return std::nullopt;
  return PlanarVector(points[static_cast<std::size_t>(point.link)] - point.at_m);
}

Eigen::Matrix<double, 2, kGeometryCount> error_gradient(const SurveyPoint& point, const GeometryVector& geometry,
                                                        const LinkageSides& sides) {
  const PointCost cost(new PointError{point, sides});
  Eigen::Matrix<double, 2, kGeometryCount, Eigen::RowMajor> gradient;
  gradient.setZero();
  PlanarVector residual;
  const double* blocks[] = {geometry.data()};
  double* gradients[] = {gradient.data()};
  if (!cost.Evaluate(blocks, residual.data(), gradients)) gradient.setZero();
  return gradient;
}

Eigen::Matrix2d whitening_of(const Kinematics& kinematics, const MachineDescription& machine,
                             const JointVector& joints_rad, int link, double point_sigma_m) {
  Eigen::Matrix2d covariance = point_sigma_m * point_sigma_m * Eigen::Matrix2d::Identity();
  const double encoder_variance = machine.sensors.encoder_step_m * machine.sensors.encoder_step_m / 12;
  PlanarVector beyond = PlanarVector::Zero();  // from joint i to the point
  for (int i = link; i >= 0; --i) {
    const double along = joints_rad.head(i + 1).sum();
    beyond += machine.links[static_cast<std::size_t>(i)].length_m * PlanarVector(std::cos(along), std::sin(along));
    const double lever = kinematics.cylinder_at(i, joints_rad[i]).value().lever_m;
    const PlanarVector across(-beyond.y(), beyond.x());
    covariance += across * across.transpose() * (encoder_variance / (lever * lever));
  }
  const Eigen::Matrix2d factor = covariance.llt().matrixL();
  return factor.inverse();
}

std::optional<GeometryVector> fit_geometry(const std::vector<SurveyPoint>& points, const GeometryPrior& prior,
                                           bool robust) {
  constexpr double kRobustScale = 2;  // of unit variance
  GeometryVector geometry = prior.mean;
  ceres::Problem problem;
  for (const SurveyPoint& point : points) {
    if (!point.used) continue;
    problem.AddResidualBlock(new PointCost(new PointError{point, prior.sides}),
                             robust ? new ceres::CauchyLoss(kRobustScale) : nullptr, geometry.data());
  }
  problem.AddResidualBlock(
      new ceres::AutoDiffCostFunction<PriorError, kGeometryCount, kGeometryCount>(new PriorError{prior}), nullptr,
      geometry.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = 100;
  options.function_tolerance = 1e-12;
  options.parameter_tolerance = 1e-12;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) return std::nullopt;
  return geometry;
}

}  // namespace knuckle::estimation
