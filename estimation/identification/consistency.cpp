#include "estimation/identification/consistency.h"

#include <ceres/ceres.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "machine/description.h"

namespace knuckle::estimation {
namespace {

/// |R (p(x) - free)|^2 with R^T R = information, in scaled unknowns x: those of p, but d_i in place of J_i.
class DistanceCost {
 public:
  DistanceCost(const CalibrationVector& free, const CalibrationMatrix& information, const JointVector& greatest_kg)
      : free_(free), greatest_kg_(greatest_kg) {
    const Eigen::SelfAdjointEigenSolver<CalibrationMatrix> eigen(information);
    root_ = eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() * eigen.eigenvectors().transpose();
  }
  template <typename T>
  bool operator()(const T* x, T* residual) const {
    using Vector = Eigen::Matrix<T, kCalibrationCount, 1>;
    Vector p = Eigen::Map<const Vector>(x);
    for (int i = 0; i < kJoints; ++i) {
      const T& d = x[i];
      p[i] = (p[3 + i] * p[3 + i] + p[6 + i] * p[6 + i]) / greatest_kg_[i] + d * d;
    }
    Eigen::Map<Vector> r(residual);
    r = root_.cast<T>() * (p - free_.cast<T>());
    return true;
  }

 private:
  CalibrationVector free_;
  JointVector greatest_kg_;
  CalibrationMatrix root_;
};

double least_inertia(const CalibrationVector& p, int link, const JointVector& greatest_kg) noexcept {
  return (std::pow(p[3 + link], 2) + std::pow(p[6 + link], 2)) / greatest_kg[link];
}

}  // namespace

JointVector greatest_mass_kg(const MachineDescription& machine) {
  constexpr double kMore = 1.25;
  JointVector mass = JointVector::Zero();
  double beyond = machine.bucket_linkage.rocker_mass_kg + machine.bucket_linkage.coupler_mass_kg;
  for (int i = kJoints - 1; i >= 0; --i) {
    const auto k = static_cast<std::size_t>(i);
    beyond += machine.links[k].mass_kg + machine.cylinders[k].body_mass_kg + machine.cylinders[k].rod_mass_kg;
    mass[i] = kMore * beyond;
  }
  return mass;
}

bool physically_consistent(const CalibrationVector& parameters, const JointVector& greatest_kg) noexcept {
  for (int i = 0; i < kJoints; ++i) {
    if (!(parameters[i] >= least_inertia(parameters, i, greatest_kg))) return false;
    if (!(parameters[friction_index(i, kViscous)] >= 0)) return false;
  }
  return true;
}

CalibrationVector nearest_consistent(const CalibrationVector& free, const CalibrationMatrix& information,
                                     const JointVector& greatest_kg) {
  if (physically_consistent(free, greatest_kg)) return free;
  CalibrationVector x = free;
  for (int i = 0; i < kJoints; ++i) {
    const double least = least_inertia(free, i, greatest_kg);
    // Not at 0, where the slope of d^2 is none.
    x[i] = std::sqrt(std::max(free[i] - least, 0.05 * least + 1e-6));
  }
  for (int i = 0; i < kJoints; ++i) {
    double& viscous = x[friction_index(i, kViscous)];
    viscous = std::max(viscous, 0.0);
  }
  ceres::Problem problem;
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<DistanceCost, kCalibrationCount, kCalibrationCount>(
                               new DistanceCost(free, information, greatest_kg)),
                           nullptr, x.data());
  for (int i = 0; i < kJoints; ++i) problem.SetParameterLowerBound(x.data(), friction_index(i, kViscous), 0);
  ceres::Solver::Options options;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-12;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  CalibrationVector p = x;
  for (int i = 0; i < kJoints; ++i) p[i] = least_inertia(x, i, greatest_kg) + x[i] * x[i];
  return p;
}

}  // namespace knuckle::estimation
