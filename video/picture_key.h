// What pictures are sealed with on their way.
#pragma once

#include <array>
#include <cstdint>

namespace knuckle::video {

/// Master key (16 bytes) and salt (12) of SRTP with AES-128-GCM (RFC 7714).
using PictureKey = std::array<std::uint8_t, 28>;

}  // namespace knuckle::video
