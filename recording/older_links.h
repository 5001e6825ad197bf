// Datagrams of the link's versions before this one, in the recordings of their time.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace knuckle::recording {

/// Recordings of links from this version on are read.
inline constexpr int kOldestLinkVersion = 7;

struct TranslatedDatagram {
  std::vector<std::uint8_t> bytes;  ///< As this version would have sent it.
  bool led_by_waves = false;        ///< A set-point that was not followed as it is, but by the waves beside it.
};

/// Of version 7, which had an energy and wave variables at the end of both sides' messages.
/// @return nullopt where it is no datagram that this version took.
[[nodiscard]] std::optional<TranslatedDatagram> from_link_version_7(std::span<const std::uint8_t> datagram);

}  // namespace knuckle::recording
