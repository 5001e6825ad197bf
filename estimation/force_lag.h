// What makes a signal as late as the reported force.
#pragma once

#include <array>

#include "estimation/foh_filter.h"
#include "estimation/force_estimator.h"

namespace knuckle::estimation {

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

}  // namespace knuckle::estimation
