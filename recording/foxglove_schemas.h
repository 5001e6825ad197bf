// ROS 2 definitions of Foxglove's messages that a recording has: field by field those of
// https://github.com/foxglove/foxglove-sdk.
#pragma once

#include <string>
#include <string_view>

namespace knuckle::recording {

inline constexpr const char* kLogSchemaName = "foxglove_msgs/msg/Log";
inline constexpr const char* kTransformsSchemaName = "foxglove_msgs/msg/FrameTransforms";
inline constexpr const char* kSceneSchemaName = "foxglove_msgs/msg/SceneUpdate";
inline constexpr const char* kPictureSchemaName = "foxglove_msgs/msg/CompressedImage";

/// The definition of one of these, and behind it those of all messages within.
[[nodiscard]] std::string foxglove_schema(std::string_view name);

}  // namespace knuckle::recording
