// Keys for pictures that travel beside a session, not in it: what both its ends can make, and nobody else.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace knuckle::secure {

/// Exported from a session (RFC 5705, label "EXPORTER-knuckle-video"); no key itself.
using VideoSecret = std::array<std::uint8_t, 32>;
/// Master key and salt of SRTP with AES-128-GCM (RFC 7714).
using VideoKey = std::array<std::uint8_t, 28>;

/// The key of one camera's pictures: the beginning of HMAC-SHA-256 of its name. Pictures of another camera do not open
/// with it.
[[nodiscard]] VideoKey video_key(const VideoSecret& secret, std::string_view camera);

}  // namespace knuckle::secure
