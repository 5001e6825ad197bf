// Means with their confidence intervals.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace knuckle::operators {

/// Of a mean of n independent values, each of one participant.
struct MeanInterval {
  std::size_t n = 0;
  std::optional<double> mean;        ///< None where n = 0.
  std::optional<double> half_width;  ///< Of the 95 % interval; none where n < 2.
};

/// Mean, and Student's t times its standard error: mean +- t(0.975, n - 1) s / sqrt(n).
[[nodiscard]] MeanInterval mean_interval(const std::vector<double>& values);

}  // namespace knuckle::operators
