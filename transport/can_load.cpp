#include "transport/can_load.h"

#include <algorithm>
#include <array>
#include <boost/crc.hpp>

namespace knuckle {
namespace {

// State: value and length (1 to 4) of the run of equal bits at the end of what was sent, as 4 * value + length - 1. A
// fifth equal bit is followed by a stuff bit of the opposite value, which starts a new run.
constexpr std::size_t kRuns = 8;
struct AfterBits {
  std::uint8_t run = 0, stuffed = 0;
};

constexpr AfterBits after_bit(std::size_t run, bool bit) noexcept {
  const std::size_t length = bit == (run >= 4) ? run % 4 + 2 : 1;
  if (length < 5) return {static_cast<std::uint8_t>(4 * bit + length - 1), 0};
  return {static_cast<std::uint8_t>(4 * !bit), 1};
}

constexpr std::array<std::array<AfterBits, 256>, kRuns> kAfterByte = [] {
  std::array<std::array<AfterBits, 256>, kRuns> table{};
  for (std::size_t run = 0; run < kRuns; ++run) {
    for (std::size_t byte = 0; byte < 256; ++byte) {
      AfterBits& after = table[run][byte];
      after.run = static_cast<std::uint8_t>(run);
      for (int at = 7; at >= 0; --at) {
        const AfterBits next = after_bit(after.run, (byte >> at & 1U) != 0);
        after = {next.run, static_cast<std::uint8_t>(after.stuffed + next.stuffed)};
      }
    }
  }
  return table;
}();

/// Counts the stuff bits of what is put.
class Stuffing {
 public:
  void put(std::uint64_t value, unsigned bits) noexcept {
    for (; bits >= 8; bits -= 8) take(kAfterByte[run_][value >> (bits - 8) & 0xFFU]);
    while (bits-- > 0) take(after_bit(run_, (value >> bits & 1U) != 0));
  }
  [[nodiscard]] unsigned stuff_bits() const noexcept { return stuffed_; }

 private:
  void take(const AfterBits& after) noexcept {
    run_ = after.run;
    stuffed_ += after.stuffed;
  }
  std::size_t run_ = 4;  // the idle bus is recessive; the start of frame ends that run
  unsigned stuffed_ = 0;
};

}  // namespace

unsigned frame_bits(const CanFrame& frame) noexcept {
  const auto size = std::min<std::uint8_t>(frame.size, 8);
  // Start of frame, identifier, RTR, IDE, r0, length: 19 bits; extended: start of frame, 11 bits of identifier, SRR,
  // IDE, the other 18, RTR, r1, r0, length: 39 bits. Zeros before them leave the CRC as it is.
  const bool extended = (frame.id & kExtendedId) != 0;
  const std::uint64_t id = frame.id & kMostExtendedId;
  const std::uint64_t head =
      (extended ? (id >> 18 & 0x7FFU) << 27 | std::uint64_t{3} << 25 | (id & 0x3FFFFU) << 7 : (id & 0x7FFU) << 7) |
      size;
  std::array<std::uint8_t, 5> head_bytes{};
  for (unsigned i = 0; i < head_bytes.size(); ++i)
    head_bytes[i] = static_cast<std::uint8_t>(head >> 8 * (head_bytes.size() - 1 - i));
  boost::crc_optimal<15, 0x4599, 0, 0, false, false> crc;  // CRC-15 of ISO 11898-1
  crc.process_bytes(head_bytes.data(), head_bytes.size());
  crc.process_bytes(frame.data.data(), size);
  Stuffing stuffing;
  stuffing.put(head, extended ? 39 : 19);
  for (std::uint8_t i = 0; i < size; ++i) stuffing.put(frame.data[i], 8);
  stuffing.put(crc.checksum(), 15);
  return least_bits(size, frame.id) + stuffing.stuff_bits();
}

CanLoad can_load(std::span<const PeriodicFrame> frames, std::uint32_t bit_rate) noexcept {
  CanLoad load;
  for (const PeriodicFrame& f : frames) {
    load.least += f.rate_Hz * least_bits(f.size, f.id) / bit_rate;
    load.worst_case += f.rate_Hz * worst_case_bits(f.size, f.id) / bit_rate;
  }
  return load;
}

std::array<double, 2> CanMeter::take_loads(Time now, std::uint32_t bit_rate, std::uint32_t second) noexcept {
  std::array<double, 2> shares{};
  if (since_ != kNever && now > since_) {
    const auto of = [passed_s = to_seconds(now - since_)](std::uint64_t bits, std::uint32_t rate) {
      return static_cast<double>(bits) / (passed_s * static_cast<double>(rate));
    };
    shares = {of(bits_[0], bit_rate), of(bits_[1], second)};
  }
  since_ = now;
  bits_ = {};
  return shares;
}

}  // namespace knuckle
