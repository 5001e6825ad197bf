// What the rates of the cylinders' torques tell, against the transfer functions they stand for.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "estimation/bias_filter.h"
#include "estimation/force_estimator.h"
#include "tests/estimation/test_machine.h"

namespace knuckle::estimation {
namespace {

using Complex = std::complex<double>;

constexpr double kTorque_Nm = 1000;

/// A torque that swings: what `answer` makes of e^{i w t}, once nothing of its start is left. @return the largest
/// difference to `expected` (a transfer function's value), of the torque's amplitude.
template <typename Answer>
double error(double w_radps, Complex expected, Answer answer) {
  double worst = 0;
  for (int k = 0; k < 2000; ++k) {
    const double t = k * kStep_s;
    const double found = answer(kTorque_Nm * std::exp(Complex(0, w_radps * t)));
    if (k >= 1000)
      worst = std::max(worst, std::abs(found - (kTorque_Nm * expected * std::exp(Complex(0, w_radps * t))).real()));
  }
  return worst / kTorque_Nm;
}

// Late transmitters and an observer behind them: the lag's column takes off what they lack, as fast as it swings.
TEST(TorqueRate, TakesTheLagOffATorqueThatSwings) {
  constexpr double kLag_s = 7e-3;
  for (const ChannelBand& band : {kSlowBand, kFastBand, kContactBand}) {
    const double a = 2 * std::numbers::pi * band.observer_Hz;
    for (const double w : {3.0, 12.6, 19.0, 40.0, 75.0}) {
      const Complex s(0, w), observer = a / (s + a), transmitter = 1.0 / (1.0 + kLag_s * s);
      FohFilter<JointVector> filter(band.observer_Hz, kStep_s);
      TorqueRate rate(band.observer_Hz, kStep_s);
      const auto answer = [&](Complex torque) {
        const JointVector seen_Nm = JointVector::Constant((transmitter * torque).real());
        rate.step(seen_Nm);
        return filter.step(seen_Nm)[0] - kLag_s * rate.columns(Eigen::Matrix3d::Identity())(0, kJoints);
      };
      const double lacks = std::abs(observer * (1.0 - transmitter));
      EXPECT_LT(error(w, observer, answer), 0.03 * lacks + 1e-3) << band.observer_Hz << " Hz, " << w << " rad/s";
    }
  }
}

TEST(TorqueRate, ShakesTheLinksByWhatTheTorquesRateMovesThem) {
  const Eigen::Matrix3d inertia = (Eigen::Matrix3d() << 900, 400, 50, 400, 300, 40, 50, 40, 20).finished();
  const double a = 2 * std::numbers::pi * kSlowBand.observer_Hz;
  for (const double w : {3.0, 12.6, 19.0}) {
    const Complex s(0, w), shaken = a * s * s / (s + a);
    for (int joint = 0; joint < kJoints; ++joint)
      for (int row = 0; row < kJoints; ++row) {
        TorqueRate rate(kSlowBand.observer_Hz, kStep_s);
        const auto answer = [&](Complex torque) {
          rate.step(torque.real() * JointVector::Unit(joint));
          return rate.columns(inertia)(row, joint);
        };
        EXPECT_LT(error(w, -inertia(row, joint) * shaken, answer),
                  (0.5 * w * kStep_s + 0.02) * inertia(row, joint) * std::abs(shaken))
            << w << " rad/s, joint " << joint << ", row " << row;
      }
  }
}

}  // namespace
}  // namespace knuckle::estimation
