#include "estimation/identification/savitzky_golay.h"

#include <Eigen/QR>
#include <cmath>

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

}  // namespace knuckle::estimation
