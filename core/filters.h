// Small filters with exact discretisation, for fixed steps. No I/O, no allocation.
#pragma once

#include <cmath>
#include <numbers>

namespace knuckle {

/// First-order low-pass y' = a (u - y), discretised for an input held over each step (zero-order hold).
/// T is double or a fixed-size Eigen vector.
template <typename T>
class LowPass {
 public:
  LowPass(double cutoff_Hz, double step_s, T initial) noexcept
      : blend_(1.0 - std::exp(-2.0 * std::numbers::pi * cutoff_Hz * step_s)), value_(initial) {}
  const T& step(const T& input) noexcept {
    value_ += blend_ * (input - value_);
    return value_;
  }
  void reset(const T& value) noexcept { value_ = value; }
  [[nodiscard]] const T& value() const noexcept { return value_; }

 private:
  double blend_;
  T value_;
};

}  // namespace knuckle
