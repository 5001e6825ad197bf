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

/// What differs from machine to machine.
struct Words {
  const char* first = "configure";
  const char* zero = "preset";
  bool angles = false;       ///< Whose zeros are found before anything moves.
  bool guards_first = true;  ///< What ends motion is tried at rest; else after the signs, in motion.
  bool dead_bands = true;
  bool far = true;  ///< Strokes and dead bands are made, not skipped.
};

inline Script answers(const Words& words) {
  const char* const go = words.far ? "go" : "skip";
  Script script{"ready", words.first, "pressed", "released", "0"};
  const auto zero = [&] { script.insert(script.end(), {"tape", words.zero}); };
  for (int j = 0; words.angles && j < kJoints; ++j) zero();
  script.emplace_back("pilot");
  if (words.guards_first) script.emplace_back("guards");
  script.emplace_back("move");
  for (int j = 0; j < kJoints; ++j) script.insert(script.end(), {"go", "longer", "go", "shorter"});
  if (!words.guards_first) script.emplace_back("guards");
  for (int j = 0; j < kJoints; ++j) {
    script.insert(script.end(), {go, go});
    if (words.far) script.emplace_back("go");  // back to the middle
    if (!words.angles) zero();
  }
  if (words.dead_bands) script.insert(script.end(), {go, go, go});
  script.emplace_back("finish");
  return script;
}

/// Of the shipped machine.
inline Script all() {
  return answers({});
}
/// Words up to the first motion, and up to the ends of these steps.
inline constexpr std::size_t kStarted = 8, kSigned = kStarted + 12, kStroked = kSigned + 15;
inline Script first_words(std::size_t count) {
  Script script = all();
  script.resize(count);
  return script;
}
inline Script start() {
  return first_words(kStarted);
}

}  // namespace knuckle::bringup::test
