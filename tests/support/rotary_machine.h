// Machine files with a rotary encoder on each joint in place of the wire encoders: the shipped one in other words.
#pragma once

#include <array>
#include <string>

#include "tests/support/few_nodes.h"

namespace knuckle::test {

/// How they are mounted: the boom's begins a new turn within the joint's range.
inline constexpr std::array<const char*, 3> kRotaryKeys{"steps_per_turn = 16384\nsign = -1\nzero_rad = 0.4\n",
                                                        "steps_per_turn = 16384\nturns = 4096\nzero_rad = -3.1\n",
                                                        "steps_per_turn = 16384\nsign = -1\nzero_rad = 2.0\n"};

/// @param text with [[bus.node]] tables.
inline std::string with_rotary_encoders(std::string text) {
  for (std::size_t joint = 0; joint < kRotaryKeys.size(); ++joint) {
    const std::string name = kJointNames[joint], channel = "{ 1 = \"" + name + "_length\" }\n";
    text.replace(text.find(channel), channel.size(), "{ 1 = \"" + name + "_angle\" }\n" + kRotaryKeys[joint]);
  }
  const std::string step = "encoder_step_mm = 0.1\n";
  return text.replace(text.find(step), step.size(), "");
}

/// The default machine, a node for each signal.
inline std::string rotary_text() {
  return with_rotary_encoders(shipped_text());
}

}  // namespace knuckle::test
