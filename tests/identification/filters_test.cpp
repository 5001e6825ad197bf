// Savitzky-Golay and symmetric filters: exactness, validity, phase.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "estimation/identification/smoothing.h"

namespace knuckle::estimation {
namespace {

/// Response of a symmetric kernel to a cosine.
double gain(const Eigen::VectorXd& kernel, double frequency_Hz, double step_s) {
  double sum = 0;
  const Eigen::Index half = kernel.size() / 2;
  for (Eigen::Index i = -half; i <= half; ++i)
    sum += kernel[i + half] * std::cos(2 * std::numbers::pi * frequency_Hz * static_cast<double>(i) * step_s);
  return sum;
}

TEST(SavitzkyGolay, IsExactForPolynomialsUpToItsOrderInAllThreeDerivatives) {
  const double step_s = 0.005;
  for (const int order : {2, 3, 4}) {
    for (int derivative = 0; derivative <= 2; ++derivative) {
      const int half = 10;
      const Eigen::VectorXd kernel = savitzky_golay(half, order, derivative, step_s);
      for (int power = 0; power <= order; ++power) {
        double sum = 0;
        for (int i = -half; i <= half; ++i) sum += kernel[i + half] * std::pow(0.3 + i * step_s, power);
        double exact = std::pow(0.3, power - derivative);
        for (int n = 0; n < derivative; ++n) exact *= power - n;
        EXPECT_NEAR(sum, exact, 1e-9) << "order " << order << " derivative " << derivative << " power " << power;
      }
    }
  }
}

TEST(SavitzkyGolay, SevenPointQuadraticDerivativeHasTheTextbookCoefficients) {
  const Eigen::VectorXd kernel = savitzky_golay(3, 2, 1, 1);
  for (int i = -3; i <= 3; ++i) EXPECT_NEAR(kernel[i + 3], i / 28.0, 1e-15);
}

TEST(ZeroPhase, FiltersKeepToTheirRunAndLeaveItsEndsUnknown) {
  Eigen::MatrixXd signal = Eigen::MatrixXd::Random(2, 60);
  signal.col(30).setConstant(std::numeric_limits<double>::quiet_NaN());
  const std::vector<Stretch> stretches{{0, 30}, {31, 60}};
  const Eigen::MatrixXd box = box_filtered(signal, 3, stretches);
  const Eigen::MatrixXd same = filtered(signal, Eigen::VectorXd::Constant(7, 1.0 / 7), stretches);
  for (Eigen::Index i = 0; i < 60; ++i) {
    const bool known = (i >= 3 && i < 27) || (i >= 34 && i < 57);
    EXPECT_EQ(std::isfinite(box(0, i)), known) << i;
    EXPECT_EQ(std::isfinite(same(1, i)), known) << i;
    if (known) {
      EXPECT_NEAR(box(1, i), same(1, i), 1e-13) << i;
    }
  }
  EXPECT_EQ(total_size(shortened(stretches, 3)), 24 + 23);
}

TEST(ZeroPhase, LowPassDeclaresItsCurve) {
  const double step_s = 0.005;
  for (const double cutoff_Hz : {2.0, 5.0}) {
    const Eigen::VectorXd kernel = low_pass_kernel(cutoff_Hz, step_s);
    EXPECT_NEAR(gain(kernel, 0, step_s), 1, 1e-12);
    EXPECT_NEAR(gain(kernel, cutoff_Hz / 2, step_s), 1, 0.02);
    EXPECT_NEAR(gain(kernel, cutoff_Hz, step_s), 0.5, 0.02);
    for (double f = 1.5 * cutoff_Hz; f < 60; f += 0.37) EXPECT_LT(std::abs(gain(kernel, f, step_s)), 0.02) << f;
  }
}

}  // namespace
}  // namespace knuckle::estimation
