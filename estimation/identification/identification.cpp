// How well modelled torque explains measured torque.
#include "estimation/identification/identification.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimation/identification/smoothing.h"

namespace knuckle::estimation {
namespace {

Eigen::MatrixXd as_matrix(const std::vector<JointVector>& samples) {
  Eigen::MatrixXd matrix(kJoints, static_cast<Eigen::Index>(samples.size()));
  for (std::size_t i = 0; i < samples.size(); ++i) matrix.col(static_cast<Eigen::Index>(i)) = samples[i];
  return matrix;
}

std::vector<JointVector> as_samples(const Eigen::MatrixXd& matrix) {
  std::vector<JointVector> samples;
  for (Eigen::Index i = 0; i < matrix.cols(); ++i) samples.emplace_back(matrix.col(i));
  return samples;
}

/// Sums over the samples that have both.
struct Moments {
  double n = 0, error = 0, error2 = 0, measured = 0, measured2 = 0;
  void add(double measured_Nm, double modelled_Nm) noexcept {
    const double e = measured_Nm - modelled_Nm;
    if (!std::isfinite(e)) return;
    n += 1;
    error += e;
    error2 += e * e;
    measured += measured_Nm;
    measured2 += measured_Nm * measured_Nm;
  }
};

}  // namespace

TorqueComparison low_passed(const TorqueComparison& comparison, double cutoff_Hz) {
  const Eigen::VectorXd kernel = low_pass_kernel(cutoff_Hz, comparison.step_s);
  const std::vector<Stretch> stretches = usable_stretches(comparison.usable);
  const auto smooth = [&](const std::vector<JointVector>& samples) {
    return as_samples(filtered(as_matrix(samples), kernel, stretches));
  };
  TorqueComparison passed{comparison.step_s, smooth(comparison.measured_Nm), smooth(comparison.modelled_Nm),
                          std::vector<std::uint8_t>(comparison.usable.size(), 0)};
  for (const Stretch& stretch : shortened(stretches, kernel.size() / 2))
    std::fill(passed.usable.begin() + stretch.first, passed.usable.begin() + stretch.end, std::uint8_t{1});
  return passed;
}

TorqueFit torque_fit(const TorqueComparison& comparison, double cutoff_Hz) {
  if (cutoff_Hz > 0) return torque_fit(low_passed(comparison, cutoff_Hz), 0);
  const Eigen::MatrixXd measured = as_matrix(comparison.measured_Nm), modelled = as_matrix(comparison.modelled_Nm);
  TorqueFit fit;
  fit.rms_Nm.setConstant(std::numeric_limits<double>::quiet_NaN());
  fit.nrmse = fit.vaf = fit.rms_Nm;
  for (int j = 0; j < kJoints; ++j) {
    Moments m;
    for (const Stretch& stretch : usable_stretches(comparison.usable)) {
      for (Eigen::Index i = stretch.first; i < stretch.end; ++i) m.add(measured(j, i), modelled(j, i));
    }
    if (m.n < 2) continue;
    const double variance = m.measured2 / m.n - std::pow(m.measured / m.n, 2);
    fit.rms_Nm[j] = std::sqrt(m.error2 / m.n);
    constexpr double kRounding = 1e-12;
    if (variance <= kRounding * m.measured2 / m.n) continue;  // constant: nothing to relate the error to
    fit.nrmse[j] = fit.rms_Nm[j] / std::sqrt(variance);
    fit.vaf[j] = 1 - (m.error2 / m.n - std::pow(m.error / m.n, 2)) / variance;
  }
  return fit;
}

}  // namespace knuckle::estimation
