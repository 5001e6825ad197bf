#include "estimation/identification/survey_geometry.h"

#include <ceres/ceres.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "machine/description.h"
#include "machine/encoder_length.h"

namespace knuckle::estimation {

const std::array<const char*, kGeometryCount> kGeometryNames{
    "boom length",           "arm length",           "bucket length",    "boom parent pin x",
    "boom parent pin z",     "boom child pin x",     "boom child pin z", "arm parent pin x",
    "arm parent pin z",      "arm child pin x",      "arm child pin z",  "bucket cylinder pin x",
    "bucket cylinder pin z", "rocker pin x",         "rocker pin z",     "bucket pin x",
    "bucket pin z",          "rocker length",        "coupler length",   "boom encoder offset",
    "arm encoder offset",    "bucket encoder offset"};

GeometryVector geometry_of(const MachineDescription& m) {
  GeometryVector g;
  const BucketLinkage& linkage = m.bucket_linkage;
  g << m.links[kBoom].length_m, m.links[kArm].length_m, m.links[kBucket].length_m, m.boom_mount.parent_pin_m,
      m.boom_mount.child_pin_m, m.arm_mount.parent_pin_m, m.arm_mount.child_pin_m, linkage.cylinder_pin_m,
      linkage.rocker_pin_m, linkage.bucket_pin_m, linkage.rocker_length_m, linkage.coupler_length_m,
      m.sensors.encoder_offset_m;
  return g;
}

GeometryCalibration to_calibration(const GeometryVector& g) {
  GeometryCalibration c;
  c.length_m = g.segment<3>(kLinkLength);
  c.boom_parent_pin_m = g.segment<2>(kBoomParent);
  c.boom_child_pin_m = g.segment<2>(kBoomChild);
  c.arm_parent_pin_m = g.segment<2>(kArmParent);
  c.arm_child_pin_m = g.segment<2>(kArmChild);
  c.cylinder_pin_m = g.segment<2>(kCylinderPin);
  c.rocker_pin_m = g.segment<2>(kRockerPin);
  c.bucket_pin_m = g.segment<2>(kBucketPin);
  c.rocker_length_m = g[kRockerLength];
  c.coupler_length_m = g[kCouplerLength];
  c.encoder_offset_m = g.segment<3>(kEncoderOffset);
  return c;
}

MachineDescription with_geometry(const MachineDescription& machine, const GeometryVector& geometry) {
  MachineDescription changed = machine;
  changed.valve_calibration = {};
  changed.geometry_calibration = to_calibration(geometry);
  return calibrated(changed);
}

LinkageSides sides_of(const MachineDescription& machine) {
  const Kinematics kinematics(machine);
  const auto middle = [&](std::size_t i) { return 0.5 * (machine.links[i].min_rad + machine.links[i].max_rad); };
  const auto side = [](double value) { return value > 0 ? 1.0 : -1.0; };
  LinkageSides sides;
  sides.boom = side(kinematics.cylinder_at(kBoom, middle(kBoom)).value().lever_m);
  sides.arm = side(kinematics.cylinder_at(kArm, middle(kArm)).value().lever_m);
  // H on the bucket side is where both circles meet; its side of G-J and K's side of H-joint tell the branch.
  const BucketLinkage& linkage = machine.bucket_linkage;
  const PlanarVector joint(machine.links[kArm].length_m, 0);
  const PlanarVector pin = joint + Eigen::Rotation2Dd(middle(kBucket)) * linkage.bucket_pin_m;
  PlanarVector crank;
  detail::circles_meet<double>(linkage.rocker_pin_m, linkage.rocker_length_m, pin, linkage.coupler_length_m,
                               linkage.branch > 0 ? 1.0 : -1.0, crank);
  sides.rocker =
      side(detail::cross<double>(linkage.rocker_pin_m - linkage.cylinder_pin_m, crank - linkage.cylinder_pin_m));
  sides.coupler = side(detail::cross<double>(joint - crank, pin - crank));
  return sides;
}

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

GeometryPrior geometry_prior(const MachineDescription& nominal) {
  GeometryPrior prior{geometry_of(nominal), GeometryVector::Constant(kPinSigma_m), sides_of(nominal)};
  prior.sigma[kRockerLength] = prior.sigma[kCouplerLength] = kRodSigma_m;
  prior.sigma.segment<kJoints>(kEncoderOffset).setConstant(kEncoderOffsetSigma_m);
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
  const JointVector encoder_variance = length_steps_m(machine).cwiseAbs2() / 12;
  PlanarVector beyond = PlanarVector::Zero();  // from joint i to the point
  for (int i = link; i >= 0; --i) {
    const double along = joints_rad.head(i + 1).sum();
    beyond += machine.links[static_cast<std::size_t>(i)].length_m * PlanarVector(std::cos(along), std::sin(along));
    const double lever = kinematics.cylinder_at(i, joints_rad[i]).value().lever_m;
    const PlanarVector across(-beyond.y(), beyond.x());
    covariance += across * across.transpose() * (encoder_variance[i] / (lever * lever));
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
