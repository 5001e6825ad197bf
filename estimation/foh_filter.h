// First-order low-pass that is exact for inputs straight between samples (first-order hold): the F(s) = a / (s + a) of
// the filtered regressor and of the momentum observer.
#pragma once

#include <cmath>
#include <numbers>
#include <type_traits>

namespace knuckle::estimation {

/// y+ = lambda y + b0 u+ + b1 u with lambda = exp(-aT), b0 = 1 - (1 - lambda)/(aT), b1 = (1 - lambda)/(aT) - lambda.
/// T is double or a fixed-size Eigen array or vector.
template <typename T>
class FohFilter {
 public:
  FohFilter(double cutoff_Hz, double step_s) noexcept {
    const double at = 2.0 * std::numbers::pi * cutoff_Hz * step_s;
    lambda_ = std::exp(-at);
    b0_ = 1.0 - (1.0 - lambda_) / at;
    b1_ = (1.0 - lambda_) / at - lambda_;
  }
  /// Output 0 so far, input from now on.
  void start(const T& input) noexcept {
    input_ = input;
    value_ = zero();
  }
  /// As if the input had been `input` for ever.
  void reset(const T& input) noexcept { input_ = value_ = input; }
  const T& step(const T& input) noexcept {
    value_ = lambda_ * value_ + b0_ * input + b1_ * input_;
    input_ = input;
    return value_;
  }
  [[nodiscard]] const T& value() const noexcept { return value_; }

 private:
  /// T() of an Eigen type is whatever was in memory.
  static T zero() noexcept {
    if constexpr (std::is_arithmetic_v<T>) {
      return 0;
    } else {
      return T::Zero();
    }
  }

  double lambda_, b0_, b1_;
  T value_ = zero(), input_ = zero();
};

}  // namespace knuckle::estimation
