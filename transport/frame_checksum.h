// What a frame is closed with, so that its receiver can tell one that is old, lost or damaged: a counter and a
// checksum.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "transport/can_bus.h"
#include "transport/signal_codec.h"

namespace knuckle {

/// 0, 1, 2 ... from frame to frame, and from 0 again.
struct FrameCounter {
  BitField field;             ///< Its raw value is the count.
  std::uint64_t modulus = 0;  ///< Counts that there are; 0: all that the field has.
  bool operator==(const FrameCounter&) const = default;
};

struct FrameChecksum {
  enum class Kind : std::uint8_t {
    kSum,  ///< Modulo 256.
    kXor,
    kCrc8J1850,  ///< SAE J1850: polynomial 0x1D, start and final XOR 0xFF; of "123456789" 0x4B.
    kCrc8H2f,    ///< AUTOSAR's second: polynomial 0x2F, start and final XOR 0xFF; of "123456789" 0xDF.
  } kind = Kind::kSum;
  BitField field;  ///< Taken as 0 while its own bytes are summed; of one with fewer than 8 bits the low ones count.
  std::array<std::uint8_t, 8> bytes{};    ///< Which bytes of the frame (0 to 7), in the order in which they are summed.
  std::uint8_t byte_count = 0;            ///< How many of these.
  std::array<std::uint8_t, 2> data_id{};  ///< Bytes that both ends know and nobody sends, in their order.
  std::uint8_t data_id_count = 0;         ///< How many of these.
  bool data_id_first = false;             ///< Before the frame's bytes, else behind them.
  bool operator==(const FrameChecksum&) const = default;
};

struct FrameClosing {
  std::optional<FrameCounter> counter;
  std::optional<FrameChecksum> checksum;  ///< Over the counter as well, where that is in its bytes.
  bool operator==(const FrameClosing&) const = default;
};

/// The count that follows.
[[nodiscard]] std::uint64_t next_count(const FrameCounter& counter, std::uint64_t count) noexcept;
/// Of this frame; bytes that it does not have are 0.
[[nodiscard]] std::uint8_t checksum_of(const FrameChecksum& checksum, const CanFrame& frame) noexcept;

/// Writes counter and checksum into a frame whose other fields are written. @param count below the modulus.
void close_frame(const FrameClosing& closing, std::uint64_t count, CanFrame& frame) noexcept;

enum class FrameFault : std::uint8_t {
  kNone,
  kTooShort,         ///< For counter, checksum or a byte that is summed.
  kChecksumWrong,    ///< Nothing in it counts, its counter neither.
  kCounterRepeated,  ///< The same frame again, or a sender that no longer counts: also a count beyond the modulus.
  kCounterSkipped,   ///< Not the one that follows: frames are lost or out of order.
};
struct FrameCheck {
  FrameFault fault = FrameFault::kNone;
  std::optional<std::uint64_t>
      count;  ///< To hold the next frame against: this one's, or the one before where it does not count.
};
/// @param previous count of the frame before; nothing where there was none.
[[nodiscard]] FrameCheck check_frame(const FrameClosing& closing, std::optional<std::uint64_t> previous,
                                     const CanFrame& frame) noexcept;

}  // namespace knuckle
