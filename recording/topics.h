// The topics of a recording, in their order in every file.
#pragma once

#include <array>
#include <cstdint>

#include "recording/mcap/contents.h"

namespace knuckle::recording {

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
