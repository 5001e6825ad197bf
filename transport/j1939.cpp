#include "transport/j1939.h"

namespace knuckle::j1939 {

CanFrame request_frame(std::uint32_t group, std::uint8_t source, std::uint8_t destination) noexcept {
  CanFrame frame{.id = identifier(kRequest, source, destination), .size = 3, .data = {}};
  for (unsigned i = 0; i < 3; ++i) frame.data[i] = static_cast<std::uint8_t>(group >> 8 * i);
  return frame;
}

std::optional<std::uint32_t> requested(const CanFrame& frame) noexcept {
  if (!is_of(kRequest, frame.id) || frame.size < 3) return std::nullopt;
  return frame.data[0] | std::uint32_t{frame.data[1]} << 8 | std::uint32_t{frame.data[2]} << 16;
}

CanFrame claim_frame(std::uint64_t name, std::uint8_t source) noexcept {
  CanFrame frame{.id = identifier(kAddressClaim, source), .size = 8, .data = {}};
  for (unsigned i = 0; i < 8; ++i) frame.data[i] = static_cast<std::uint8_t>(name >> 8 * i);
  return frame;
}

std::optional<std::uint64_t> claimed_name(const CanFrame& frame) noexcept {
  if (!is_of(kAddressClaim, frame.id) || frame.size < 8) return std::nullopt;
  std::uint64_t name = 0;
  for (unsigned i = 0; i < 8; ++i) name |= std::uint64_t{frame.data[i]} << 8 * i;
  return name;
}

}  // namespace knuckle::j1939
