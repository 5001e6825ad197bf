#include "app/studies/tip_geometry.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace knuckle::studies {
namespace {

using Complex = std::complex<double>;
using Unknowns = std::array<double, TipGeometry::kCount>;

constexpr double kRobust_m = 0.01;
constexpr double kPi = std::numbers::pi;

Complex unit(double angle_rad) {
  return std::polar(1.0, angle_rad);
}

Complex plane(const PlanarVector& p) {
  return {p.x(), p.y()};
}

/// psi + p0 for a rocker angle: A cos p + B sin p = C.
template <typename T>
T driven_angle(const T* u, const T& rocker, double branch) {
  using std::acos;
  using std::atan2;
  using std::cos;
  using std::sin;
  using std::sqrt;
  const T f = rocker + u[TipGeometry::kF0];
  const T a = u[TipGeometry::kK2] + cos(f), b = sin(f);
  T cosine = (u[TipGeometry::kK1] * cos(f) + u[TipGeometry::kK3]) / sqrt(a * a + b * b);
  constexpr double kClosed = 1 - 1e-9;  // an outlying angle may lie where the loop does not close
  if (cosine > kClosed) cosine = T(kClosed);
  if (cosine < -kClosed) cosine = T(-kClosed);
  return atan2(b, a) + branch * acos(cosine);
}

template <typename T>
void modelled_tip(const T* u, const TipSample& s, double branch, T& x, T& z) {
  using std::cos;
  using std::sin;
  std::array<T, kJoints> angle;
  for (int i = 0; i < kJoints; ++i) {
    angle[static_cast<std::size_t>(i)] = s.angle_rad[i] - u[TipGeometry::kLatency_s] * s.rate_radps[i];
  }
  const T boom = angle[kBoom] + u[TipGeometry::kBoomAngle];
  const T line = angle[kBoom] + angle[kArm];
  const T arm = line + u[TipGeometry::kArmAngle];
  const T bucket = line + driven_angle(u, angle[kBucket], branch) - u[TipGeometry::kP0];
  x = u[TipGeometry::kBaseX] + u[TipGeometry::kBoom_m] * cos(boom) + u[TipGeometry::kArm_m] * cos(arm) +
      u[TipGeometry::kBucket_m] * cos(bucket);
  z = u[TipGeometry::kBaseZ] + u[TipGeometry::kBoom_m] * sin(boom) + u[TipGeometry::kArm_m] * sin(arm) +
      u[TipGeometry::kBucket_m] * sin(bucket);
}

struct SampleError {
  TipSample sample;
  double branch;
  template <typename T>
  bool operator()(const T* u, T* residual) const {
    modelled_tip(u, sample, branch, residual[0], residual[1]);
    residual[0] -= sample.tip_m.x();
    residual[1] -= sample.tip_m.y();
    return true;
  }
};

/// Rocker and bucket angle of one sample.
struct LinkagePoint {
  double rocker_rad, psi_rad;
};

/// k1, k2, k3 for given offsets by linear least squares, and their mean squared error.
struct Loop {
  Eigen::Vector3d k;
  double f0 = 0, p0 = 0, error = std::numeric_limits<double>::infinity();
};

Loop loop_at(const std::vector<LinkagePoint>& points, double f0, double p0) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double squares = 0;
  for (const LinkagePoint& point : points) {
    const double f = point.rocker_rad + f0, p = point.psi_rad + p0;
    const Eigen::Vector3d row(std::cos(f), -std::cos(p), 1);
    const double y = std::cos(f - p);
    normal += row * row.transpose();
    right += row * y;
    squares += y * y;
  }
  const Eigen::Vector3d k = normal.ldlt().solve(right);
  return {k, f0, p0, (squares - k.dot(right)) / static_cast<double>(points.size())};
}

/// The best loops over a grid of offsets, best first. Turning f and p by half a turn is the same loop: p in one half.
std::vector<Loop> best_loops(const std::vector<LinkagePoint>& points, std::size_t most) {
  constexpr double kStep = kPi / 36;
  std::vector<Loop> loops;
  for (double f0 = -kPi; f0 < kPi; f0 += kStep) {
    for (double p0 = -kPi / 2; p0 < kPi / 2; p0 += kStep) {
      const Loop loop = loop_at(points, f0, p0);
      if (loop.k.allFinite() && loop.k.norm() < 100) loops.push_back(loop);
    }
  }
  std::sort(loops.begin(), loops.end(), [](const Loop& a, const Loop& b) { return a.error < b.error; });
  loops.resize(std::min(most, loops.size()));
  return loops;
}

Unknowns start_of(const PlainChain& chain, const Loop& loop) {
  const auto& c = chain.coefficient;
  return {c[0].real(),    c[0].imag(), std::abs(c[1]), std::arg(c[1]), std::abs(c[2]), std::arg(c[2]),
          std::abs(c[3]), loop.k[0],   loop.k[1],      loop.k[2],      loop.f0,        loop.p0,
          /*latency*/ 0};
}

struct Fit {
  TipGeometry geometry;
  double cost = std::numeric_limits<double>::infinity();
};

/// @param every only every n-th sample. @param sigma also the standard deviations.
Fit polished(const std::vector<TipSample>& samples, Fit fit, std::size_t every, bool sigma) {
  Unknowns& u = fit.geometry.value;
  ceres::Problem problem;
  for (std::size_t i = 0; i < samples.size(); i += every) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<SampleError, 2, TipGeometry::kCount>(
                                 new SampleError{samples[i], fit.geometry.branch}),
                             new ceres::CauchyLoss(kRobust_m), u.data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-10;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  fit.cost = summary.IsSolutionUsable() ? summary.final_cost : std::numeric_limits<double>::infinity();
  if (!sigma) return fit;
  ceres::Covariance::Options dense;
  dense.algorithm_type = ceres::DENSE_SVD;
  dense.null_space_rank = -1;
  ceres::Covariance covariance(dense);
  std::array<double, TipGeometry::kCount * TipGeometry::kCount> block{};
  const std::vector<const double*> blocks{u.data()};
  if (covariance.Compute(blocks, &problem) && covariance.GetCovarianceBlock(u.data(), u.data(), block.data())) {
    const double variance = 2 * fit.cost / static_cast<double>(2 * samples.size() - u.size());
    for (std::size_t i = 0; i < u.size(); ++i) {
      fit.geometry.sigma[i] = std::sqrt(std::max(0.0, block[i * (u.size() + 1)] * variance));
    }
  }
  return fit;
}

}  // namespace

PlanarVector TipGeometry::tip(const TipSample& sample) const {
  PlanarVector at;
  modelled_tip(value.data(), sample, branch, at.x(), at.y());
  return at;
}

PlanarVector PlainChain::tip(const JointVector& angle) const {
  const Complex at = coefficient[0] + coefficient[1] * unit(angle[kBoom]) +
                     coefficient[2] * unit(angle[kBoom] + angle[kArm]) +
                     coefficient[3] * unit(angle[kBoom] + angle[kArm] + bucket_factor * angle[kBucket]);
  return {at.real(), at.imag()};
}

PlainChain fit_plain_chain(const std::vector<TipSample>& samples, double bucket_factor, bool robust) {
  constexpr int kReweightings = 30;
  constexpr double kLeastError_m = 1e-3;
  const auto rows = static_cast<Eigen::Index>(samples.size());
  Eigen::Matrix<Complex, Eigen::Dynamic, 4> regressor(rows, 4);
  Eigen::VectorXcd tip(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const TipSample& s = samples[static_cast<std::size_t>(i)];
    const double boom = s.angle_rad[kBoom], arm = boom + s.angle_rad[kArm];
    regressor.row(i) << 1, unit(boom), unit(arm), unit(arm + bucket_factor * s.angle_rad[kBucket]);
    tip[i] = plane(s.tip_m);
  }
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(rows), error;
  Eigen::Vector4cd c;
  for (int i = 0; i < (robust ? kReweightings : 1); ++i) {
    const auto weighted = (weight.asDiagonal() * regressor).eval();
    c = (regressor.adjoint() * weighted).ldlt().solve(weighted.adjoint() * tip);
    error = (regressor * c - tip).cwiseAbs();
    weight = error.cwiseMax(kLeastError_m).cwiseInverse();
  }
  return {{c[0], c[1], c[2], c[3]}, bucket_factor, error.mean()};
}

std::optional<TipGeometry> fit_tip_geometry(const std::vector<TipSample>& samples) {
  constexpr std::size_t kLeastSamples = 50, kGridPoints = 80, kStartPoints = 300, kStarts = 6;
  if (samples.size() < kLeastSamples) return std::nullopt;
  PlainChain chain = fit_plain_chain(samples, 1, true);
  for (double factor = -2; factor <= 2; factor += 0.1) {  // of a bucket that turns in proportion to the rocker
    const PlainChain other = fit_plain_chain(samples, factor, true);
    if (other.mean_error_m < chain.mean_error_m) chain = other;
  }
  std::vector<LinkagePoint> points;
  for (std::size_t i = 0; i < samples.size(); i += 1 + samples.size() / kGridPoints) {
    const TipSample& s = samples[i];
    const Complex line = unit(s.angle_rad[kBoom] + s.angle_rad[kArm]);
    const Complex rest = plane(s.tip_m) - chain.coefficient[0] - chain.coefficient[1] * unit(s.angle_rad[kBoom]) -
                         chain.coefficient[2] * line;
    points.push_back({s.angle_rad[kBucket], std::arg(rest / line)});
  }
  Fit best;
  for (const Loop& loop : best_loops(points, kStarts)) {
    for (const double branch : {1.0, -1.0}) {
      Fit start;
      start.geometry.value = start_of(chain, loop);
      start.geometry.branch = branch;
      const Fit fit = polished(samples, start, 1 + samples.size() / kStartPoints, false);
      if (fit.cost < best.cost) best = fit;
    }
  }
  if (!std::isfinite(best.cost)) return std::nullopt;
  best = polished(samples, best, 1, true);
  return std::isfinite(best.cost) ? std::optional(best.geometry) : std::nullopt;
}

}  // namespace knuckle::studies
