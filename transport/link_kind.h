// What a datagram of the link is, by its header alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "transport/bytes.h"

namespace knuckle {

enum class LinkKind : std::uint8_t { kMaster = 1, kSlave = 2, kStatus = 3 };
inline constexpr std::uint16_t kLinkMagic = 0x4E4B;  // "KN"
inline constexpr std::uint8_t kLinkVersion = 8;
inline constexpr std::size_t kLinkHeaderSize = 4;  ///< Magic, version, kind.

/// nullopt where the header is not one of this version. The kind may be one that nobody knows.
[[nodiscard]] inline std::optional<LinkKind> link_kind(std::span<const std::uint8_t> bytes) noexcept {
  ByteReader in(bytes);
  const bool ours = in.get<std::uint16_t>() == kLinkMagic && in.get<std::uint8_t>() == kLinkVersion;
  const auto kind = in.get<std::uint8_t>();
  if (!ours || !in.ok()) return std::nullopt;
  return static_cast<LinkKind>(kind);
}

}  // namespace knuckle
