// The way a hand goes from one place to another.
#pragma once

#include <algorithm>

namespace knuckle::sim {

inline constexpr double kPeakOfMinimumJerk = 1.875;  ///< Peak speed over mean speed.

/// Minimum-jerk position in [0, 1] for u in [0, 1] (Flash and Hogan 1985).
[[nodiscard]] inline double minimum_jerk(double u) noexcept {
  u = std::clamp(u, 0.0, 1.0);
  return u * u * u * (10 + u * (-15 + 6 * u));
}

}  // namespace knuckle::sim
