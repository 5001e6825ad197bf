#include "estimation/identification/consistency.h"

#include <ceres/ceres.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "machine/description.h"

namespace knuckle::estimation {
namespace {

/// Unknowns x in place of parameters p, so that every condition is a bound of one: d_i for J_i; for each cylinder's
/// Coulomb forces their mean and half their difference; for breakaway the static friction.
template <typename Vector>
void to_parameters(const JointVector& greatest_kg, Vector& p) {
  for (int i = 0; i < kJoints; ++i) {
    p[i] = (p[3 + i] * p[3 + i] + p[6 + i] * p[6 + i]) / greatest_kg[i] + p[i] * p[i];
    auto &extend = p[friction_index(i, kCoulombExtend)], &retract = p[friction_index(i, kCoulombRetract)];
    const auto mean = extend, offset = retract;
    extend = mean + offset;
    retract = mean - offset;
    p[friction_index(i, kBreakaway)] -= mean;
  }
}

/// |R (p(x) - free)|^2 with R^T R = information.
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
    to_parameters(greatest_kg_, p);
    Eigen::Map<Vector> r(residual);
    r = root_.cast<T>() * (p - free_.cast<T>());
    return true;
  }

 private:
  CalibrationVector free_;
  JointVector greatest_kg_;
  CalibrationMatrix root_;
};

/// The unknowns of a cylinder's friction that have a bound: viscosity, mean Coulomb and static friction, what load and
/// seals add.
std::array<int, 5> bounded_friction(int joint) noexcept {
  return {friction_index(joint, kViscous), friction_index(joint, kCoulombExtend), friction_index(joint, kBreakaway),
          friction_index(joint, kLoadShare), friction_index(joint, kSeal)};
}
constexpr double kLeastFriction = 1e-9;  // SI units; not 0, which the digits of a file round to either side

/// Puts what is below its bound onto it, and says which unknowns stay there.
void hold_at_bounds(CalibrationVector& x, std::vector<int>& held) {
  for (int i = 0; i < kJoints; ++i) {
    for (const int k : bounded_friction(i)) {
      if (x[k] >= kLeastFriction) continue;
      x[k] = kLeastFriction;
      held.push_back(k);
    }
  }
}

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
    const auto friction = [&](FrictionIndex which) { return parameters[friction_index(i, which)]; };
    const double coulomb_N = (friction(kCoulombExtend) + friction(kCoulombRetract)) / 2;
    if (!(friction(kViscous) >= 0 && coulomb_N >= 0 && coulomb_N + friction(kBreakaway) >= 0 &&
          friction(kLoadShare) >= 0 && friction(kSeal) >= 0))
      return false;
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
    auto &extend = x[friction_index(i, kCoulombExtend)], &retract = x[friction_index(i, kCoulombRetract)];
    const double mean = (extend + retract) / 2, offset = (extend - retract) / 2;
    x[friction_index(i, kBreakaway)] += std::max(mean, 0.0);
    extend = mean;
    retract = offset;
  }
  ceres::Problem problem;
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<DistanceCost, kCalibrationCount, kCalibrationCount>(
                               new DistanceCost(free, information, greatest_kg)),
                           nullptr, x.data());
  ceres::Solver::Options options;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-12;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  // Ceres' own bounds cut each step: where unknowns are coupled it then ends away from the minimum.
  std::vector<int> held;
  std::size_t known = 0;
  hold_at_bounds(x, held);
  do {
    known = held.size();
    problem.SetManifold(x.data(), new ceres::SubsetManifold(kCalibrationCount, held));
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    hold_at_bounds(x, held);
  } while (held.size() > known);
  to_parameters(greatest_kg, x);
  for (int k = 0; k < kCalibrationCount; ++k) {
    if (information(k, k) == 0) x[k] = free[k];
  }
  return x;
}

}  // namespace knuckle::estimation
