// Symmetric filters for recorded signals. What they cannot know they leave unknown: within half a kernel of a stretch's
// ends the answer is NaN, and shortened(stretches, ...) says what is left.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace knuckle::estimation {

// Stretches of a recording without gaps: filters keep inside one and never across its ends.

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

// Smoothing and differentiation by a polynomial fitted to a sliding window (Savitzky and Golay, 1964).

/// FIR coefficients, to be laid over samples i - half_window .. i + half_window (first coefficient on the earliest).
/// Their sum of products is the derivative at sample i of the polynomial that fits the window best: exact for
/// polynomials up to `order`.
/// @param derivative 0 (smoothing), 1 [1/s] or 2 [1/s^2]; @param order of the polynomial, below 2 half_window + 1.
[[nodiscard]] Eigen::VectorXd savitzky_golay(int half_window, int order, int derivative, double step_s);

/// @param signals one row a signal, one column a sample; @param kernel of odd size.
/// @return same shape: kernel laid over each sample's surroundings (correlation, first coefficient on the earliest).
[[nodiscard]] Eigen::MatrixXd filtered(const Eigen::MatrixXd& signals, const Eigen::VectorXd& kernel,
                                       const std::vector<Stretch>& stretches);

/// Mean of 2 half_window + 1 samples, in a time that does not depend on half_window. Two in a row make a triangle.
[[nodiscard]] Eigen::MatrixXd box_filtered(const Eigen::MatrixXd& signals, Eigen::Index half_window,
                                           const std::vector<Stretch>& stretches);

/// Likewise, but near a stretch's ends over the part of the window that there is.
[[nodiscard]] Eigen::MatrixXd running_mean(const Eigen::MatrixXd& signals, Eigen::Index half_window,
                                           const std::vector<Stretch>& stretches);

/// Low-pass of odd size without phase: Hann-windowed sinc that reaches 2 / cutoff_Hz to either side. Half its height at
/// the cut-off, within 1 % of 1 below 0.5 and of 0 beyond 1.5 times that.
[[nodiscard]] Eigen::VectorXd low_pass_kernel(double cutoff_Hz, double step_s);

}  // namespace knuckle::estimation
