// Stretches of a recording without gaps: filters keep inside one and never across its ends.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace knuckle::estimation {

/// Consecutive usable samples, end not included.
struct Stretch {
  Eigen::Index first = 0, end = 0;
  [[nodiscard]] Eigen::Index size() const noexcept { return end - first; }
};

[[nodiscard]] inline std::vector<Stretch> usable_stretches(const std::vector<std::uint8_t>& usable) {
  std::vector<Stretch> stretches;
  const auto size = static_cast<Eigen::Index>(usable.size());
  for (Eigen::Index i = 0; i < size; ++i) {
    if (usable[static_cast<std::size_t>(i)] == 0) continue;
    if (stretches.empty() || stretches.back().end != i) stretches.push_back({i, i});
    stretches.back().end = i + 1;
  }
  return stretches;
}

/// What is left where a filter that looks `samples` to either side is known; too short stretches vanish.
[[nodiscard]] inline std::vector<Stretch> shortened(const std::vector<Stretch>& stretches, Eigen::Index samples) {
  std::vector<Stretch> result;
  for (const Stretch& stretch : stretches) {
    if (stretch.size() > 2 * samples) result.push_back({stretch.first + samples, stretch.end - samples});
  }
  return result;
}

[[nodiscard]] inline Eigen::Index total_size(const std::vector<Stretch>& stretches) noexcept {
  Eigen::Index total = 0;
  for (const Stretch& stretch : stretches) total += stretch.size();
  return total;
}

}  // namespace knuckle::estimation
