#include "recording/scene.h"

#include "recording/cdr.h"

namespace knuckle::recording {

std::string transforms_schema() {
  return "";
}
std::string scene_schema() {
  return "";
}

SceneWriter::SceneWriter(const MachineDescription& machine) : machine_(machine), kinematics_(machine), room_(4096) {}

std::span<const std::uint8_t> SceneWriter::transforms(const slave::SlaveState&, std::int64_t) {
  return {};
}
std::span<const std::uint8_t> SceneWriter::scene(const slave::SlaveState&, std::int64_t) {
  return {};
}

}  // namespace knuckle::recording
