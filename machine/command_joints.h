// Which frames of commands move joints: only of those can be tried, and must be proved, what ends a motion.
#pragma once

#include <algorithm>
#include <cstdint>

#include "machine/bus_description.h"

namespace knuckle {

/// In place of a module's id.
inline constexpr std::uint8_t kOwnController = 0;

/// Whether what this module's outputs, or the machine's own controller, are told moves this joint.
[[nodiscard]] inline bool moves_joint(const BusDescription& bus, std::uint8_t module, int joint) noexcept {
  return std::any_of(bus.commands.begin(), bus.commands.end(), [&](const CommandFrame& frame) {
    return frame.module == module && std::any_of(frame.fields.begin(), frame.fields.end(),
                                                 [&](const CommandField& field) { return field.joint == joint; });
  });
}
[[nodiscard]] inline bool moves_joints(const BusDescription& bus, std::uint8_t module) noexcept {
  return moves_joint(bus, module, kBoom) || moves_joint(bus, module, kArm) || moves_joint(bus, module, kBucket);
}

}  // namespace knuckle
