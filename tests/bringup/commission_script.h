// What a person answers who commissions a machine with which all is well.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>

#include "app/bringup/commission_dialogue.h"
#include "core/joints.h"

namespace knuckle::bringup::test {

using Script = std::deque<std::string>;

/// What is typed, a line a call, until the input ends. @param script outlives it
inline auto lines_of(Script& script) {
  return [&script]() -> std::optional<std::string> {
    if (script.empty()) throw CommissionEnded("the input has ended");
    std::string line = script.front();
    script.pop_front();
    return line;
  };
}

/// Up to the first motion.
inline Script start() {
  return {"ready", "configure", "pressed", "released", "0", "pilot", "guards", "move"};
}
inline Script all() {
  Script script = start();
  for (int j = 0; j < kJoints; ++j) script.insert(script.end(), {"go", "longer", "go", "shorter"});
  for (int j = 0; j < kJoints; ++j) script.insert(script.end(), {"go", "go", "go", "tape", "preset"});
  script.insert(script.end(), {"go", "go", "go", "finish"});
  return script;
}

inline constexpr std::size_t kSigned = 8 + 12, kStroked = kSigned + 15;  ///< Words up to the ends of these steps.

}  // namespace knuckle::bringup::test
