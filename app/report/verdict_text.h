// What a session achieved, as text: for the summary and the report.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "app/session/session_result.h"

namespace knuckle::report {

/// "piece broken off, 45 kg lifted and weighed within 0.4 kg, put down; no fault"
[[nodiscard]] std::string done_text(const session::Judged& judged);

/// "passed: 3 of 3 safety bounds and 12 of 12 requirements met"
[[nodiscard]] std::string verdict_text(const session::Judged& judged);

/// "2 of 16 goals not reached"
[[nodiscard]] std::string goals_text(const session::Judged& judged);

/// "1150 ms", "not measured", "never".
[[nodiscard]] std::string measured_text(const session::CriterionResult& result);
/// "0.349, goal 0.3"; "1150 ms, at most 200 ms".
[[nodiscard]] std::string value_text(const session::CriterionResult& result);
/// Of unfelt time, what no control law can change: "the device cannot show 0.12 s of it"; empty for all else.
[[nodiscard]] std::string excuse_text(const session::CriterionResult& result, const session::Metrics& metrics);
/// "31.6 s, back off"; empty where there is no such moment.
[[nodiscard]] std::string moment_text(const session::CriterionResult& result);

/// Results in the order in which they should be read.
struct Sorted {
  std::vector<const session::CriterionResult*> failed;   ///< Missed, and they decide.
  std::vector<const session::CriterionResult*> shown;    ///< Requirements missed where they do not decide.
  std::vector<const session::CriterionResult*> towards;  ///< Goals not reached.
  std::vector<const session::CriterionResult*> met;      ///< Goals among them.
  std::vector<const session::CriterionResult*> open;     ///< Not judged: cut short.
};
[[nodiscard]] Sorted sorted(const session::Judged& judged);

/// Name of a phase or an event as it is read: "piece broke" of "piece_broke".
[[nodiscard]] std::string plain_text(std::string_view name);

}  // namespace knuckle::report
