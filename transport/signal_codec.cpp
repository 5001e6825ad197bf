#include "transport/signal_codec.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace knuckle {
namespace {

using bit_field_detail::in_order;
using bit_field_detail::mask_of;
using bit_field_detail::shift_of;

bool fits_a_frame(const BitField& field) noexcept {
  return bytes_of(field) <= sizeof(CanFrame::data);
}

// Nearest and saturated, as canopen::to_steps.
std::uint64_t integer_of(const BitField& field, double value) noexcept {
  double steps = std::round((value - field.offset) / field.scale);
  if (std::isnan(steps)) steps = std::round((0 - field.offset) / field.scale);
  if (std::isnan(steps)) return 0;
  const std::uint64_t mask = mask_of(field), top_bit = mask - (mask >> 1);
  if (field.type == BitField::Type::kUnsigned) {
    if (steps <= 0) return 0;
    return steps >= 2 * static_cast<double>(top_bit) ? mask : static_cast<std::uint64_t>(steps);
  }
  const auto limit = static_cast<double>(top_bit);
  if (steps <= -limit) return top_bit;
  return steps >= limit ? mask >> 1 : static_cast<std::uint64_t>(static_cast<std::int64_t>(steps)) & mask;
}

std::uint64_t bits_in_frame(const BitField& field) noexcept {
  return fits_a_frame(field) ? in_order(mask_of(field) << shift_of(field), field.order) : 0;
}

}  // namespace

std::uint64_t raw_of(const BitField& field, double value) noexcept {
  if (field.type != BitField::Type::kFloat) return integer_of(field, value);
  const double number = (value - field.offset) / field.scale;
  if (field.bits == 64) return std::bit_cast<std::uint64_t>(number);
  return std::bit_cast<std::uint32_t>(static_cast<float>(number));
}

// Command frames and the simulated machine's own frames are written with it; tests read both with decoders of their
// own.
void write_raw(const BitField& field, std::uint64_t raw, CanFrame& frame) noexcept {
  if (!fits_a_frame(field)) return;
  const std::uint64_t mask = mask_of(field);
  const unsigned shift = shift_of(field);
  const std::uint64_t others = bit_field_detail::word_of(frame, field.order) & ~(mask << shift);
  frame.data = std::bit_cast<decltype(frame.data)>(in_order(others | (raw & mask) << shift, field.order));
  frame.size = std::max(frame.size, bytes_of(field));
}

void write_value(const BitField& field, double value, CanFrame& frame) noexcept {
  if (fits_a_frame(field)) write_raw(field, raw_of(field, value), frame);
}

bool overlap(const BitField& a, const BitField& b) noexcept {
  return (bits_in_frame(a) & bits_in_frame(b)) != 0;
}

}  // namespace knuckle
