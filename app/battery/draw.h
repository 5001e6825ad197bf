// How values are drawn.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "app/battery/settings.h"
#include "core/seed.h"
#include "sim/operator_limb.h"

namespace knuckle::battery {

[[nodiscard]] inline double between(std::mt19937_64& random, double low, double high) {
  return low + (high - low) * unit_interval(random);
}
[[nodiscard]] inline double by_ratio(std::mt19937_64& random, const Span& span) {
  return span.low * std::pow(span.high / span.low, unit_interval(random));
}
[[nodiscard]] inline std::size_t pick(std::mt19937_64& random, std::size_t count) {
  return static_cast<std::size_t>(unit_interval(random) * static_cast<double>(count));
}
[[nodiscard]] inline double one_of(std::mt19937_64& random, const std::vector<double>& values) {
  return values[pick(random, values.size())];
}
[[nodiscard]] inline sim::LimbClass draw_limb(std::mt19937_64& random) {
  constexpr std::size_t kLimbs = 4;
  return static_cast<sim::LimbClass>(pick(random, kLimbs));
}

}  // namespace knuckle::battery
