#include "estimation/contact_compliance.h"

#include <algorithm>
#include <cmath>

namespace knuckle::estimation {
namespace {

constexpr double kLeastVariance_m2 = 1e-9;  // a few hundredths of a millimetre: no way at all

}  // namespace

double ContactCompliance::step(const PlanarVector& tip_m, const PlanarVector& force_N) noexcept {
  if (!started_) tip_.reset(tip_m);
  started_ = true;
  const PlanarVector before = tip_.value();
  const PlanarVector moved = tip_.step(tip_m) - before;
  const double size_N = force_N.norm();
  if (!(size_N > kTouch_N)) {
    touching_ = false;
    return 0;
  }
  if (!touching_) {
    touching_ = true;
    way_m_ = mean_m_ = variance_m2_ = covariance_Nm_ = 0;
    mean_N_ = size_N;
  }
  way_m_ -= moved.dot(force_N) / size_N;
  const double blend = -std::expm1(-step_s_ / kMemory_s);
  const double off_m = way_m_ - mean_m_, off_N = size_N - mean_N_;
  mean_m_ += blend * off_m;
  mean_N_ += blend * off_N;
  variance_m2_ = (1 - blend) * (variance_m2_ + blend * off_m * off_m);
  covariance_Nm_ = (1 - blend) * (covariance_Nm_ + blend * off_m * off_N);
  const double stiffness = std::max(0.0, covariance_Nm_) / (variance_m2_ + kLeastVariance_m2);
  const double stiff = stiffness / kStiffness_N_per_m;
  return variance_m2_ / (variance_m2_ + kSeen_m * kSeen_m) / (1 + stiff * stiff);
}

}  // namespace knuckle::estimation
