// Histogram of durations with fixed logarithmic bins: adding is a few instructions and never allocates.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/time.h"

namespace knuckle {

/// Eight bins an octave from 64 ns to 17 s, so a quantile is right to within 1/8; the maximum is exact. Negative
/// durations count as zero.
class Histogram {
 public:
  void add(Duration value) noexcept;
  void merge(const Histogram& other) noexcept;

  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] Duration max() const noexcept { return max_; }
  /// Upper edge of the bin that holds quantile q in [0, 1], at most max(); zero where nothing was added.
  [[nodiscard]] Duration quantile(double q) const noexcept;
  /// Values in the bins that end at or before `edge`: exact where edge is (8 + n) 2^k ns, n 0..7.
  [[nodiscard]] std::uint64_t count_below(Duration edge) const noexcept;

 private:
  static constexpr int kBinsPerOctave = 8;
  static constexpr int kFirstOctave = 6;  ///< 2^6 ns
  static constexpr int kOctaves = 28;
  static constexpr std::size_t kBins = kBinsPerOctave * kOctaves + 1;  ///< Bin 0: below 64 ns.

  static std::size_t bin_of(std::int64_t nanoseconds) noexcept;
  static std::int64_t upper_edge(std::size_t bin) noexcept;

  std::array<std::uint64_t, kBins> bins_{};
  std::uint64_t count_ = 0;
  Duration max_{};
};

}  // namespace knuckle
