// How full a CAN bus is: bits of classic data frames with 11-bit identifier (ISO 11898-1), the share of the bus' time
// that a set of periodic frames takes, and the share that recorded frames took.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "core/time.h"
#include "transport/can_bus.h"

namespace knuckle {

/// Without any stuff bit, from start of frame to the end of the interframe space.
[[nodiscard]] constexpr unsigned least_bits(std::uint8_t size) noexcept {
  return 34U + 8U * size  // start of frame, identifier, RTR, IDE, r0, length, data, CRC: the part that is stuffed
         + 13U;           // CRC delimiter, acknowledge slot and delimiter, end of frame, interframe space
}
/// With every stuff bit that is possible: one after the first five bits, then one after every four.
[[nodiscard]] constexpr unsigned worst_case_bits(std::uint8_t size) noexcept {
  return least_bits(size) + (33U + 8U * size) / 4;
}
/// As sent: with the stuff bits that identifier, data and CRC of this very frame ask for.
[[nodiscard]] unsigned frame_bits(const CanFrame& frame) noexcept;

/// A frame that is sent again and again.
struct PeriodicFrame {
  std::uint32_t id = 0;
  std::uint8_t size = 0;
  double rate_Hz = 0;
};
/// Shares of the bus' time, [0, 1] and beyond where it does not fit.
struct CanLoad {
  double least = 0, worst_case = 0;
};
[[nodiscard]] CanLoad can_load(std::span<const PeriodicFrame> frames, std::uint32_t bit_rate) noexcept;

/// Load of frames as they come by, by their own bits.
class CanLoadMeter {
 public:
  static constexpr Duration kWindow = 100ms;
  explicit CanLoadMeter(std::uint32_t bit_rate) noexcept : bit_rate_(bit_rate) {}
  /// @param at when the frame was seen; never before an earlier one.
  void add(Time at, const CanFrame& frame) noexcept;
  /// From the first frame to the last; 0 before there are two.
  [[nodiscard]] double mean() const noexcept;
  /// The busiest of the windows that follow one another from the first frame on and have ended.
  [[nodiscard]] double busiest() const noexcept { return busiest_; }

 private:
  std::uint32_t bit_rate_;
  Time first_ = kNever, last_ = kNever, window_ = kNever;
  std::uint64_t bits_ = 0, window_bits_ = 0;
  double busiest_ = 0;
};

}  // namespace knuckle
