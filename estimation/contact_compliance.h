// Is the contact compliant? Soil and loads move along with the bucket at a constant force; the force of a wall grows
// with the way into it.
#pragma once

#include <array>

#include "core/joints.h"
#include "estimation/force_estimator.h"
#include "estimation/observer.h"

namespace knuckle::estimation {

// What makes a signal as late as the reported force.

/// The three poles of the slow channel. T is double or a fixed-size Eigen vector.
template <typename T>
class ForceLag {
 public:
  explicit ForceLag(double step_s) noexcept
      : poles_{FohFilter<T>(kSlowBand.velocity_Hz, step_s), FohFilter<T>(kSlowBand.velocity_Hz, step_s),
               FohFilter<T>(kSlowBand.observer_Hz, step_s)} {}
  const T& step(T value) noexcept {
    for (FohFilter<T>& pole : poles_) value = pole.step(value);
    return poles_.back().value();
  }
  /// As if the input had been `value` for ever.
  void reset(const T& value) noexcept {
    for (FohFilter<T>& pole : poles_) pole.reset(value);
  }
  [[nodiscard]] const T& value() const noexcept { return poles_.back().value(); }

 private:
  std::array<FohFilter<T>, 3> poles_;
};

/// Share of what is pressed against that moves along,
///   y = var(x) / (var(x) + x0^2) / (1 + (k / k0)^2),  k = cov(F, x) / var(x) >= 0,
/// over the last kMemory_s of a contact: x the way of the touched point against the force, F the force's size, both
/// equally late. 0 while the point stands (a wall must not be taken for soil), 1 where it moves on by much more than x0
/// and the force does not grow.
class ContactCompliance {
 public:
  static constexpr double kTouch_N = 150;   ///< Less is no contact.
  static constexpr double kMemory_s = 0.4;  ///< Of the covariances.
  static constexpr double kSeen_m = 1e-3;   ///< x0: over this way k0 makes some three standard deviations of F.
  static constexpr double kStiffness_N_per_m = 3e4;  ///< k0: below what soil has when a tool first goes into it.

  explicit ContactCompliance(double step_s) noexcept : step_s_(step_s), tip_(step_s) {}

  /// @param tip_m measured way of the touched point; @param force_N reported force of the world on it. Frame M.
  /// @return share of what the tip presses against that moves along with it, [0, 1]
  double step(const PlanarVector& tip_m, const PlanarVector& force_N) noexcept;
  /// The next step starts at rest, in free air.
  void reset() noexcept { started_ = touching_ = false; }

 private:
  double step_s_;
  ForceLag<PlanarVector> tip_;
  bool started_ = false, touching_ = false;
  double way_m_ = 0;  ///< Since the touch.
  double mean_m_ = 0, mean_N_ = 0, variance_m2_ = 0, covariance_Nm_ = 0;
};

}  // namespace knuckle::estimation
