// The result of one check, and what to do about it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

namespace knuckle::bringup {

struct Finding {
  enum class Level : std::uint8_t {
    kOk,
    kNote,   ///< Worth knowing; nothing has to be done.
    kFault,  ///< A machine cannot be run like this.
  } level = Level::kOk;
  std::string about;  ///< "can0", "node 0x22 arm_head_pressure", "SCHED_FIFO"
  std::string text;   ///< What was found, and what to do.
};
using Findings = std::vector<Finding>;

[[nodiscard]] inline bool healthy(const Findings& findings) noexcept {
  return std::none_of(findings.begin(), findings.end(),
                      [](const Finding& one) { return one.level == Finding::Level::kFault; });
}
/// "ok", "note", "FAULT"
[[nodiscard]] constexpr const char* name(Finding::Level level) noexcept {
  return level == Finding::Level::kOk ? "ok" : level == Finding::Level::kNote ? "note" : "FAULT";
}

}  // namespace knuckle::bringup
