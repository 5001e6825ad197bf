// Histogram of durations that forgets: what was added within a window that ends now.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/histogram.h"
#include "core/time.h"

namespace knuckle {

/// The window moves in tenths: what is in it is its whole length to a tenth less old. Adding costs as little as to a
/// Histogram.
class RecentHistogram {
 public:
  explicit RecentHistogram(Duration window = 10s) noexcept : slice_(window / kSlices) {}

  /// @param at not before zero, nor much before an earlier one.
  void add(Time at, Duration value) noexcept {
    Slice& slice = slices_[index_of(number_of(at))];
    if (slice.number != number_of(at)) slice = {number_of(at), {}};
    slice.values.add(value);
  }
  /// A few thousand additions: not for every step.
  [[nodiscard]] Histogram recent(Time now) const noexcept {
    Histogram all;
    for (const Slice& slice : slices_) {
      const bool counts = slice.number > number_of(now) - kSlices && slice.number <= number_of(now);
      if (counts) all.merge(slice.values);
    }
    return all;
  }

 private:
  static constexpr std::int64_t kSlices = 10;
  struct Slice {
    std::int64_t number = -1;
    Histogram values;
  };
  [[nodiscard]] std::int64_t number_of(Time at) const noexcept { return at.time_since_epoch() / slice_; }
  [[nodiscard]] static std::size_t index_of(std::int64_t number) noexcept {
    return static_cast<std::size_t>(number) % static_cast<std::size_t>(kSlices);
  }

  Duration slice_;
  std::array<Slice, kSlices> slices_{};
};

}  // namespace knuckle
