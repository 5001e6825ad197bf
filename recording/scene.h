// The machine and its forces as Foxglove draws them in 3-D: transforms of the links and a scene with arrows.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "machine/description.h"
#include "machine/kinematics.h"
#include "slave/slave_state.h"

namespace knuckle::recording {

inline constexpr const char* kTransformsSchemaName = "foxglove_msgs/msg/FrameTransforms";
inline constexpr const char* kSceneSchemaName = "foxglove_msgs/msg/SceneUpdate";
/// ROS 2's definitions of the two.
[[nodiscard]] std::string transforms_schema();
[[nodiscard]] std::string scene_schema();

/// Draws one machine.
class SceneWriter {
 public:
  explicit SceneWriter(const MachineDescription& machine);

  /// Messages of the two topics. @param unix_ns of session time 0. Valid until the next call.
  [[nodiscard]] std::span<const std::uint8_t> transforms(const slave::SlaveState& state, std::int64_t unix_ns);
  [[nodiscard]] std::span<const std::uint8_t> scene(const slave::SlaveState& state, std::int64_t unix_ns);

 private:
  MachineDescription machine_;
  Kinematics kinematics_;
  std::vector<std::uint8_t> room_;
};

}  // namespace knuckle::recording
