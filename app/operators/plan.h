// Which recordings a study has: who did what, with which input, under which condition.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace knuckle::operators {

/// Scales of NASA's task load index, each 0 to 100 (Hart, Staveland 1988); performance: 100 is failure.
inline constexpr std::array<const char*, 6> kLoadScales{"mental",      "physical", "temporal",
                                                        "performance", "effort",   "frustration"};
using TaskLoad = std::array<double, kLoadScales.size()>;

struct PlannedRecording {
  std::string file;  ///< As it can be opened.
  std::string participant, input, condition, task;
  std::optional<TaskLoad> load;  ///< As the participant answered.
};

/// @throws InputError with file, line, key, value and bound. Files are relative to the plan's folder.
[[nodiscard]] std::vector<PlannedRecording> load_plan(const std::string& path);

}  // namespace knuckle::operators
