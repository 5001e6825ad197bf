// What a replay found, in words, for messages of tests.
#pragma once

#include <fmt/format.h>

#include <string>

#include "recording/replay.h"

namespace knuckle::test {

/// The first differing step of each side; empty where there is none.
inline std::string words(const recording::ReplayResult& result) {
  std::string text;
  for (const recording::SideResult& side : result.sides) {
    if (!side.first) continue;
    text += fmt::format("{}: {} of {} steps differ, first at {:.4f} s (step {}):\n", name(side.first->side),
                        side.differing, side.steps, to_seconds(side.first->at), side.first->step);
    for (const std::string& line : side.first->what) text += "  " + line + "\n";
    for (const std::string& line : side.first->inputs) text += "  read: " + line + "\n";
  }
  return text;
}

}  // namespace knuckle::test
