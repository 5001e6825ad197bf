// Numbers in the data of CAN frames, at any bits of it: both byte orders, signed, float, scaled, up to 64 bits.
// Reading is inline: a loop reads each of its fields in each step.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "transport/can_bus.h"

namespace knuckle {

/// Where a number is in a CAN frame, and what it means: value = raw * scale + offset.
struct BitField {
  enum class Type : std::uint8_t { kUnsigned, kSigned, kFloat } type = Type::kUnsigned;
  enum class Order : std::uint8_t { kLittleEndian, kBigEndian } order = Order::kLittleEndian;
  /// As DBC counts: bit 0 of byte 0 is 0, bit 7 of byte 1 is 15. The field's least significant bit (little endian) or
  /// its most significant one (big endian).
  std::uint8_t start_bit = 0;
  std::uint8_t bits = 8;  ///< 1 to 64; of a float 32 or 64.
  double scale = 1;       ///< Not 0.
  double offset = 0;
  bool operator==(const BitField&) const = default;
};

/// Bits of a frame before the field, in the order in which its bytes are sent.
[[nodiscard]] constexpr unsigned bits_before(const BitField& field) noexcept {
  return field.order == BitField::Order::kLittleEndian ? field.start_bit : field.start_bit ^ 7U;
}

/// Bytes a frame needs to have it; more than 8 where no frame can.
[[nodiscard]] constexpr std::uint8_t bytes_of(const BitField& field) noexcept {
  if (field.bits == 0) return 0xFF;
  return static_cast<std::uint8_t>((bits_before(field) + field.bits + 7) / 8);
}

namespace bit_field_detail {

/// Between the bytes of a frame, taken for one word as they are, and the word in which a field of this order is one run
/// of bits.
[[nodiscard]] constexpr std::uint64_t in_order(std::uint64_t word, BitField::Order order) noexcept {
  const bool as_here = (order == BitField::Order::kLittleEndian) == (std::endian::native == std::endian::little);
  return as_here ? word : __builtin_bswap64(word);
}
[[nodiscard]] constexpr std::uint64_t word_of(const CanFrame& frame, BitField::Order order) noexcept {
  return in_order(std::bit_cast<std::uint64_t>(frame.data), order);
}
/// Of a field that a frame can have: its bits at the word's low end, and how far up they are.
[[nodiscard]] constexpr std::uint64_t mask_of(const BitField& field) noexcept {
  return ~std::uint64_t{0} >> (64U - field.bits) % 64;
}
[[nodiscard]] constexpr unsigned shift_of(const BitField& field) noexcept {
  return field.order == BitField::Order::kLittleEndian ? field.start_bit : 64U - bits_before(field) - field.bits;
}

}  // namespace bit_field_detail

/// The field's bits as they are in the frame. @return nullopt where the frame is too short.
[[nodiscard]] inline std::optional<std::uint64_t> read_raw(const BitField& field, const CanFrame& frame) noexcept {
  if (bytes_of(field) > std::min<std::size_t>(frame.size, frame.data.size())) return std::nullopt;
  const std::uint64_t word = bit_field_detail::word_of(frame, field.order);
  return word >> bit_field_detail::shift_of(field) & bit_field_detail::mask_of(field);
}

/// What such bits mean. A float may be no number at all.
[[nodiscard]] inline double value_of(const BitField& field, std::uint64_t raw) noexcept {
  const unsigned unused = (64U - field.bits) % 64;
  auto number = static_cast<double>(raw);
  if (field.type == BitField::Type::kSigned) {
    number = static_cast<double>(static_cast<std::int64_t>(raw << unused) >> unused);
  } else if (field.type == BitField::Type::kFloat) {
    number = field.bits == 64 ? std::bit_cast<double>(raw) : std::bit_cast<float>(static_cast<std::uint32_t>(raw));
  }
  const double scaled = number * field.scale;
  return field.offset == 0 ? scaled : scaled + field.offset;  // -0.0 of a float keeps its sign
}

/// read_raw() and value_of() in one.
[[nodiscard]] inline std::optional<double> read_value(const BitField& field, const CanFrame& frame) noexcept {
  const auto raw = read_raw(field, frame);
  if (!raw) return std::nullopt;
  return value_of(field, *raw);
}

/// The bits that come nearest to a value, ties away from zero, saturated to the field's range. NaN is NaN in a float,
/// and as 0 in an integer.
[[nodiscard]] std::uint64_t raw_of(const BitField& field, double value) noexcept;
/// Leaves all other bits as they are; a frame that is too short for the field becomes longer. Does nothing where no
/// frame can have it.
void write_raw(const BitField& field, std::uint64_t raw, CanFrame& frame) noexcept;
/// raw_of() and write_raw() in one.
void write_value(const BitField& field, double value, CanFrame& frame) noexcept;

/// Whether two fields share a bit of the frame.
[[nodiscard]] bool overlap(const BitField& a, const BitField& b) noexcept;

}  // namespace knuckle
