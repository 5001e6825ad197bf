// The topics of a recording, in their order in every file.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "recording/mcap/contents.h"

namespace knuckle::recording {

// ROS 2 definitions of Foxglove's messages that a recording has: field by field those of
// https://github.com/foxglove/foxglove-sdk.

inline constexpr const char* kLogSchemaName = "foxglove_msgs/msg/Log";
inline constexpr const char* kTransformsSchemaName = "foxglove_msgs/msg/FrameTransforms";
inline constexpr const char* kSceneSchemaName = "foxglove_msgs/msg/SceneUpdate";
inline constexpr const char* kPictureSchemaName = "foxglove_msgs/msg/CompressedImage";

/// The definition of one of these, and behind it those of all messages within.
[[nodiscard]] std::string foxglove_schema(std::string_view name);

enum class Topic : std::uint8_t {
  kOperatorWires,
  kOperatorState,
  kMachineWires,
  kMachineState,
  kEvents,
  kTransforms,
  kScene,
  kSceneMachine,
  kCameraStamps,
  kCameraPictures,
  kCount,
};
inline constexpr std::array<const char*, static_cast<std::size_t>(Topic::kCount)> kTopicNames{
    "/operator/wires", "/operator/state", "/machine/wires", "/machine/state",  "/events", "/tf",
    "/scene",          "/scene/machine",  "/camera/stamps", "/camera/pictures"};

/// Channel of a topic in files of Knuckle's own.
[[nodiscard]] constexpr std::uint16_t channel_of(Topic topic) noexcept {
  return static_cast<std::uint16_t>(static_cast<unsigned>(topic) + 1);
}

/// All of them with their schemas.
[[nodiscard]] mcap::Topics topics();

}  // namespace knuckle::recording
