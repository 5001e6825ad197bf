// A picture of a camera as the operator saw it, as JPEG: Foxglove's CompressedImage. Only where they were asked for.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/time.h"

namespace knuckle::recording {

struct CameraPicture {
  Time at{};           ///< Session time when the console took it to show it, as its CameraStamp has it.
  std::string camera;  ///< Its name.
  std::vector<std::uint8_t> jpeg;
};

/// foxglove_msgs/CompressedImage; the camera's name is its frame. @param unix_ns of session time 0.
[[nodiscard]] std::vector<std::uint8_t> encode_camera_picture(const CameraPicture& picture, std::int64_t unix_ns);
/// @return nothing for what is no such message.
[[nodiscard]] std::optional<CameraPicture> decode_camera_picture(std::span<const std::uint8_t> message,
                                                                 std::int64_t unix_ns);

}  // namespace knuckle::recording
