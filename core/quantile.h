// Quantiles of samples.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace knuckle {

/// The smallest sample that a share in [0, 1] of all do not exceed; NaNs do not count. NaN where there is none.
[[nodiscard]] inline double quantile(std::vector<double> samples, double share) {
  std::erase_if(samples, [](double sample) { return std::isnan(sample); });
  if (samples.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto rank = static_cast<std::ptrdiff_t>(std::ceil(share * static_cast<double>(samples.size()))) - 1;
  const auto at = samples.begin() + std::max<std::ptrdiff_t>(rank, 0);
  std::nth_element(samples.begin(), at, samples.end());
  return *at;
}

[[nodiscard]] inline double median(const std::vector<double>& samples) {
  return quantile(samples, 0.5);
}

/// The upper of the middle two where their number is even; 0 where there is none.
[[nodiscard]] inline double upper_median(std::vector<double> samples) {
  if (samples.empty()) return 0;
  const auto middle = samples.begin() + static_cast<std::ptrdiff_t>(samples.size() / 2);
  std::nth_element(samples.begin(), middle, samples.end());
  return *middle;
}

}  // namespace knuckle
