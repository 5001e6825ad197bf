#include "transport/frame_checksum.h"

#include <algorithm>
#include <cstddef>

namespace knuckle {
namespace {

using Kind = FrameChecksum::Kind;

/// The checksum so far and one byte more.
std::uint8_t with_byte(Kind kind, std::uint8_t sum, std::uint8_t byte) noexcept {
  if (kind == Kind::kSum) return static_cast<std::uint8_t>(sum + byte);
  sum ^= byte;
  if (kind == Kind::kXor) return sum;
  const unsigned polynomial = kind == Kind::kCrc8J1850 ? 0x1D : 0x2F;
  for (int bit = 0; bit < 8; ++bit) {
    const unsigned shifted = unsigned{sum} << 1U;
    sum = static_cast<std::uint8_t>((sum & 0x80U) != 0 ? shifted ^ polynomial : shifted);
  }
  return sum;
}

/// Counts that there are; 0: 2^64.
std::uint64_t modulus_of(const FrameCounter& counter) noexcept {
  return counter.modulus == 0 && counter.field.bits < 64 ? std::uint64_t{1} << counter.field.bits : counter.modulus;
}

bool reaches(const FrameChecksum& checksum, const CanFrame& frame) noexcept {
  return std::all_of(checksum.bytes.begin(), checksum.bytes.begin() + std::min<int>(checksum.byte_count, 8),
                     [&](std::uint8_t byte) { return byte < frame.size; });
}

}  // namespace

std::uint64_t next_count(const FrameCounter& counter, std::uint64_t count) noexcept {
  return count + 1 == modulus_of(counter) ? 0 : count + 1;
}

std::uint8_t checksum_of(const FrameChecksum& checksum, const CanFrame& frame) noexcept {
  CanFrame open = frame;
  write_raw(checksum.field, 0, open);
  const bool crc = checksum.kind == Kind::kCrc8J1850 || checksum.kind == Kind::kCrc8H2f;
  std::uint8_t sum = crc ? 0xFF : 0;
  const auto add_data_id = [&] {
    for (std::size_t i = 0; i < std::min<std::size_t>(checksum.data_id_count, checksum.data_id.size()); ++i)
      sum = with_byte(checksum.kind, sum, checksum.data_id[i]);
  };
  if (checksum.data_id_first) add_data_id();
  for (std::size_t i = 0; i < std::min<std::size_t>(checksum.byte_count, checksum.bytes.size()); ++i)
    sum = with_byte(checksum.kind, sum, open.data[checksum.bytes[i] % open.data.size()]);
  if (!checksum.data_id_first) add_data_id();
  return crc ? sum ^ 0xFFU : sum;
}

void close_frame(const FrameClosing& closing, std::uint64_t count, CanFrame& frame) noexcept {
  if (closing.counter) write_raw(closing.counter->field, count, frame);
  if (closing.checksum) write_raw(closing.checksum->field, checksum_of(*closing.checksum, frame), frame);
}

FrameCheck check_frame(const FrameClosing& closing, std::optional<std::uint64_t> previous,
                       const CanFrame& frame) noexcept {
  if (closing.checksum) {
    const auto received = read_raw(closing.checksum->field, frame);
    if (!received || !reaches(*closing.checksum, frame)) return {FrameFault::kTooShort, previous};
    CanFrame right = frame;
    write_raw(closing.checksum->field, checksum_of(*closing.checksum, frame), right);
    if (right != frame) return {FrameFault::kChecksumWrong, previous};
  }
  if (!closing.counter) return {};
  const auto count = read_raw(closing.counter->field, frame);
  if (!count) return {FrameFault::kTooShort, previous};
  const std::uint64_t modulus = modulus_of(*closing.counter);
  if (modulus != 0 && *count >= modulus) return {FrameFault::kCounterRepeated, previous};
  if (previous == count) return {FrameFault::kCounterRepeated, count};
  const bool follows = !previous || *count == next_count(*closing.counter, *previous);
  return {follows ? FrameFault::kNone : FrameFault::kCounterSkipped, count};
}

}  // namespace knuckle
