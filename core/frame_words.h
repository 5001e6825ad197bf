// Words for CAN frames of a CANopen controller.
#pragma once

#include <cstdint>
#include <string>

namespace knuckle {

/// What a controller sends under this identifier of the pre-defined connection set (CiA 301): "SYNC 0x080". Allocates.
[[nodiscard]] std::string controllers_frame_text(std::uint32_t id);

}  // namespace knuckle
