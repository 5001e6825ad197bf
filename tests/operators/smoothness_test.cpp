#include <gtest/gtest.h>

#include <cmath>

#include "app/operators/task_metrics.h"

namespace knuckle::operators {
namespace {

constexpr double kStep_s = 5e-3;

/// A bell of this width, cut off where it is nothing, `size` high.
std::vector<double> bell(double sigma_s, double size) {
  std::vector<double> speed;
  for (double t = -6 * sigma_s; t <= 6 * sigma_s; t += kStep_s)
    speed.push_back(size * std::exp(-t * t / (2 * sigma_s * sigma_s)));
  return speed;
}

/// Of any bell: its spectrum is exp(-w^2 sigma^2 / 2), 0.05 at w_c; with u = w / w_c the arc is that of exp(-u^2 ln 20)
/// over [0, 1], whatever sigma is. Simpson's rule.
double bell_arc_length() {
  constexpr int kSteps = 2000;
  const double k = std::log(20.0);
  double sum = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double u = double(i) / kSteps;
    const int weight = i == 0 || i == kSteps ? 1 : i % 2 == 1 ? 4 : 2;
    sum += weight * std::hypot(1, 2 * k * u * std::exp(-k * u * u));
  }
  return -sum / (3 * kSteps);
}

TEST(SpectralArcLength, OfABellIsThatOfItsKnownSpectrumWhateverItsSizeAndDuration) {
  for (const double sigma_s : {0.1, 0.3, 1.0}) {
    for (const double size : {0.1, 5.0})
      EXPECT_NEAR(spectral_arc_length(bell(sigma_s, size), kStep_s).value(), bell_arc_length(), 0.02) << sigma_s;
  }
}

TEST(SpectralArcLength, SeesThatAMotionInTwoHalvesIsLessSmooth) {
  const std::vector<double> one = bell(0.3, 1);
  std::vector<double> two = one;
  two.insert(two.end(), one.begin(), one.end());
  EXPECT_LT(spectral_arc_length(two, kStep_s).value(), 1.2 * spectral_arc_length(one, kStep_s).value());
}

TEST(SpectralArcLength, IsNoneWhereNothingMoves) {
  EXPECT_FALSE(spectral_arc_length({}, kStep_s));
  EXPECT_FALSE(spectral_arc_length({1, 2, 1}, kStep_s));
  EXPECT_FALSE(spectral_arc_length(std::vector<double>(100, 0.0), kStep_s));
}

TEST(VelocityPeaks, AreCountedWhereTheyRiseAndFallByWhatIsAsked) {
  EXPECT_EQ(velocity_peaks({}, 0.02), 0);
  EXPECT_EQ(velocity_peaks({0, 0.1, 0.2, 0.1, 0}, 0.02), 1);
  EXPECT_EQ(velocity_peaks({0, 0.2, 0.19, 0.2, 0}, 0.02), 1);
  EXPECT_EQ(velocity_peaks({0, 0.2, 0.1, 0.2, 0}, 0.02), 2);
  EXPECT_EQ(velocity_peaks({0, 0.01, 0, 0.01, 0}, 0.02), 0);
  EXPECT_EQ(velocity_peaks({0.3, 0.2, 0.1}, 0.02), 1) << "one that had begun before";
  EXPECT_EQ(velocity_peaks({0, 0.1, 0.2}, 0.02), 0) << "one that has not ended";
}

}  // namespace
}  // namespace knuckle::operators
