#include "estimation/identification/smoothing.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace knuckle::estimation {

Eigen::VectorXd savitzky_golay(int half_window, int order, int derivative, double step_s) {
  const Eigen::Index size = 2 * half_window + 1;
  eigen_assert(half_window >= 1 && order < size && derivative >= 0 && derivative <= order);
  // Over x in [-1, 1], for the sake of the conditioning: row n of the pseudo-inverse gives the coefficient of x^n.
  Eigen::MatrixXd powers(size, order + 1);
  for (Eigen::Index i = 0; i < size; ++i) {
    const double x = static_cast<double>(i - half_window) / half_window;
    for (int n = 0; n <= order; ++n) powers(i, n) = std::pow(x, n);
  }
  const Eigen::MatrixXd fit = powers.colPivHouseholderQr().solve(Eigen::MatrixXd::Identity(size, size));
  double factor = 1;
  for (int n = 1; n <= derivative; ++n) factor *= n / (half_window * step_s);
  return factor * fit.row(derivative).transpose();
}

namespace {

Eigen::MatrixXd unknown(const Eigen::MatrixXd& like) {
  return Eigen::MatrixXd::Constant(like.rows(), like.cols(), std::numeric_limits<double>::quiet_NaN());
}

/// Sums of the first n samples of a stretch, n = 0 .. size.
Eigen::MatrixXd running_sums(const Eigen::MatrixXd& signals, const Stretch& stretch) {
  Eigen::MatrixXd sums(signals.rows(), stretch.size() + 1);
  sums.col(0).setZero();
  for (Eigen::Index i = 0; i < stretch.size(); ++i) sums.col(i + 1) = sums.col(i) + signals.col(stretch.first + i);
  return sums;
}

}  // namespace

Eigen::MatrixXd filtered(const Eigen::MatrixXd& signals, const Eigen::VectorXd& kernel,
                         const std::vector<Stretch>& stretches) {
  const Eigen::Index half = kernel.size() / 2;
  Eigen::MatrixXd result = unknown(signals);
  for (const Stretch& stretch : shortened(stretches, half)) {
    for (Eigen::Index i = stretch.first; i < stretch.end; ++i)
      result.col(i).noalias() = signals.middleCols(i - half, kernel.size()) * kernel;
  }
  return result;
}

Eigen::MatrixXd box_filtered(const Eigen::MatrixXd& signals, Eigen::Index half_window,
                             const std::vector<Stretch>& stretches) {
  const Eigen::Index size = 2 * half_window + 1;
  Eigen::MatrixXd result = unknown(signals);
  for (const Stretch& stretch : stretches) {
    if (stretch.size() < size) continue;
    const Eigen::MatrixXd sums = running_sums(signals, stretch);
    result.middleCols(stretch.first + half_window, stretch.size() - size + 1) =
        (sums.rightCols(stretch.size() - size + 1) - sums.leftCols(stretch.size() - size + 1)) /
        static_cast<double>(size);
  }
  return result;
}

Eigen::MatrixXd running_mean(const Eigen::MatrixXd& signals, Eigen::Index half_window,
                             const std::vector<Stretch>& stretches) {
  Eigen::MatrixXd result = unknown(signals);
  for (const Stretch& stretch : stretches) {
    const Eigen::MatrixXd sums = running_sums(signals, stretch);
    for (Eigen::Index i = 0; i < stretch.size(); ++i) {
      const Eigen::Index first = std::max<Eigen::Index>(0, i - half_window);
      const Eigen::Index end = std::min(stretch.size(), i + half_window + 1);
      result.col(stretch.first + i) = (sums.col(end) - sums.col(first)) / static_cast<double>(end - first);
    }
  }
  return result;
}

Eigen::VectorXd low_pass_kernel(double cutoff_Hz, double step_s) {
  const auto half = static_cast<Eigen::Index>(std::ceil(2 / (cutoff_Hz * step_s)));
  Eigen::VectorXd kernel(2 * half + 1);
  for (Eigen::Index i = -half; i <= half; ++i) {
    const double x = 2 * std::numbers::pi * cutoff_Hz * static_cast<double>(i) * step_s;
    const double sinc = i == 0 ? 1 : std::sin(x) / x;
    const double window =
        0.5 + 0.5 * std::cos(std::numbers::pi * static_cast<double>(i) / static_cast<double>(half + 1));
    kernel[i + half] = sinc * window;
  }
  return kernel / kernel.sum();
}

}  // namespace knuckle::estimation
