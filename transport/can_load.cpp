#include "transport/can_load.h"

#include <algorithm>

namespace knuckle {
namespace {

/// The stuffed part of a frame, bit by bit as it leaves: counts the stuff bits, and computes the CRC on the way.
class BitStream {
 public:
  void put(std::uint32_t value, unsigned bits) noexcept {
    while (bits-- > 0) put_bit((value >> bits & 1U) != 0);
  }
  [[nodiscard]] std::uint32_t crc() const noexcept { return crc_; }
  [[nodiscard]] unsigned stuff_bits() const noexcept { return stuffed_; }

 private:
  void put_bit(bool bit) noexcept {
    const bool top = (crc_ & 0x4000U) != 0;
    crc_ = crc_ << 1 & 0x7FFFU;
    if (bit != top) crc_ ^= 0x4599U;  // CRC-15 of ISO 11898-1
    equal_ = bit == last_ ? equal_ + 1 : 1;
    last_ = bit;
    if (equal_ < 5) return;
    ++stuffed_;  // the stuff bit is the opposite one, and begins a run of its own
    last_ = !bit;
    equal_ = 1;
  }
  std::uint32_t crc_ = 0;
  bool last_ = true;  // the idle bus is recessive
  unsigned equal_ = 0, stuffed_ = 0;
};

}  // namespace

unsigned frame_bits(const CanFrame& frame) noexcept {
  const auto size = std::min<std::uint8_t>(frame.size, 8);
  BitStream stream;
  stream.put(0, 1);  // start of frame
  stream.put(frame.id & 0x7FFU, 11);
  stream.put(0, 3);  // RTR, IDE, r0
  stream.put(size, 4);
  for (std::uint8_t i = 0; i < size; ++i) stream.put(frame.data[i], 8);
  stream.put(stream.crc(), 15);
  return least_bits(size) + stream.stuff_bits();
}

CanLoad can_load(std::span<const PeriodicFrame> frames, std::uint32_t bit_rate) noexcept {
  CanLoad load;
  for (const PeriodicFrame& f : frames) {
    load.least += f.rate_Hz * least_bits(f.size) / bit_rate;
    load.worst_case += f.rate_Hz * worst_case_bits(f.size) / bit_rate;
  }
  return load;
}

}  // namespace knuckle
