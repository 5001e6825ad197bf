#include "core/histogram.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace knuckle {

std::size_t Histogram::bin_of(std::int64_t nanoseconds) noexcept {
  const auto value = static_cast<std::uint64_t>(nanoseconds);
  const int octave = static_cast<int>(std::bit_width(value)) - 1;  // Of the leading one; -1 for zero.
  if (octave < kFirstOctave) return 0;
  // The three bits after the leading one: linear bins inside the octave.
  const auto part = static_cast<std::size_t>((value >> (octave - 3)) & 7U);
  const std::size_t bin = 1 + static_cast<std::size_t>(octave - kFirstOctave) * kBinsPerOctave + part;
  return std::min(bin, kBins - 1);
}

std::int64_t Histogram::upper_edge(std::size_t bin) noexcept {
  if (bin == 0) return std::int64_t{1} << kFirstOctave;
  const std::size_t octave = (bin - 1) / kBinsPerOctave + kFirstOctave;
  const std::size_t part = (bin - 1) % kBinsPerOctave;
  return static_cast<std::int64_t>(kBinsPerOctave + part + 1) << (octave - 3);
}

void Histogram::add(Duration value) noexcept {
  value = std::max(value, Duration::zero());
  ++bins_[bin_of(value.count())];
  ++count_;
  max_ = std::max(max_, value);
}

void Histogram::merge(const Histogram& other) noexcept {
  for (std::size_t i = 0; i < kBins; ++i) bins_[i] += other.bins_[i];
  count_ += other.count_;
  max_ = std::max(max_, other.max_);
}

Duration Histogram::quantile(double q) const noexcept {
  const auto rank = static_cast<std::uint64_t>(std::ceil(std::clamp(q, 0.0, 1.0) * static_cast<double>(count_)));
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < kBins; ++i) {
    below += bins_[i];
    if (below >= rank && below > 0) return i + 1 < kBins ? std::min(Duration(upper_edge(i)), max_) : max_;
  }
  return max_;
}

std::uint64_t Histogram::count_below(Duration edge) const noexcept {
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < kBins && upper_edge(i) <= edge.count(); ++i) below += bins_[i];
  return below;
}

}  // namespace knuckle
