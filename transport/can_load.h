// How full a CAN bus is: bits of classic data frames (ISO 11898-1), and the share of the bus'
// time that a set of periodic frames takes.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/time.h"
#include "transport/can_bus.h"

namespace knuckle {

/// The part of a frame that is stuffed: start of frame, identifier, RTR, IDE, r0, length, data, CRC; with 29 bits of
/// identifier also these, SRR and r1.
[[nodiscard]] constexpr unsigned stuffed_bits(std::uint8_t size, std::uint32_t id) noexcept {
  return ((id & kExtendedId) != 0 ? 54U : 34U) + 8U * size;
}
/// Without any stuff bit, from start of frame to the end of the interframe space.
[[nodiscard]] constexpr unsigned least_bits(std::uint8_t size, std::uint32_t id = 0) noexcept {
  // CRC delimiter, acknowledge slot and delimiter, end of frame, interframe space
  return stuffed_bits(size, id) + 13U;
}
/// With every stuff bit that is possible: one after the first five bits, then one after every four.
[[nodiscard]] constexpr unsigned worst_case_bits(std::uint8_t size, std::uint32_t id = 0) noexcept {
  return least_bits(size, id) + (stuffed_bits(size, id) - 1) / 4;
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

/// Of frames as they pass, on each of two buses.
class CanMeter {
 public:
  void add(const CanFrame& frame) noexcept { bits_[(frame.id & kSecondBus) != 0 ? 1 : 0] += frame_bits(frame); }
  /// Shares of each bus' time that the frames since the last call took; 0 at the first call.
  /// @param second bit rate of the second of two
  [[nodiscard]] std::array<double, 2> take_loads(Time now, std::uint32_t bit_rate, std::uint32_t second = 1) noexcept;

 private:
  Time since_ = kNever;
  std::array<std::uint64_t, 2> bits_{};
};

}  // namespace knuckle
