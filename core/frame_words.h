// Words for CAN frames.
#pragma once

#include <cstdint>
#include <string>

namespace knuckle {

/// What a controller sends under this identifier of the pre-defined connection set (CiA 301): "SYNC 0x080". Allocates.
[[nodiscard]] std::string controllers_frame_text(std::uint32_t id);

/// As limit of a kSensorInvalid: no value counts, as its whole frame is an old one, or damaged.
inline constexpr float kCounterStands = -1, kChecksumWrong = -2;

}  // namespace knuckle
