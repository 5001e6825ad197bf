// A machine's camera by its name.
#pragma once

#include <string_view>

#include "machine/description.h"

namespace knuckle {

/// nullptr where the machine's file does not know it.
[[nodiscard]] inline const CameraDescription* find_camera(const MachineDescription& machine,
                                                          std::string_view name) noexcept {
  for (const CameraDescription& camera : machine.cameras)
    if (camera.name == name) return &camera;
  return nullptr;
}

}  // namespace knuckle
