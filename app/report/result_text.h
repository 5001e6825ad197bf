// What a session achieved, as text: for the summary and the report.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/session/session_result.h"

namespace knuckle::report {

// Numbers as people read them.

/// So many significant digits, more only before the point, never a power of ten: "3512", "0.0397", "< 0.000001". "-"
/// where it is not finite.
[[nodiscard]] std::string number_text(double value, int significant = 3);

/// Standard deviations to each side of an interval of 95 %.
inline constexpr double kTwoSided95 = 1.96;

// Metrics as text, for people who do not know their names.

/// "felt force, error of a hold" of "hold_error_N"; docs/scenarios.md says exactly how each is measured. The name
/// itself where there is no text for it.
[[nodiscard]] std::string metric_text(std::string_view name);

/// "from the hand to the valve" of the hop "hand_to_valve"; likewise.
[[nodiscard]] std::string hop_text(std::string_view hop);

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

// The result of a session for a person at a terminal: what was done, what failed, which goals are not reached yet.

/// @param report where the HTML report went; empty if none was written. @param verbose also what was met.
[[nodiscard]] std::string summary_text(const session::Judged& judged, const std::string& report, bool verbose = false);

/// A number as short as it can be read, with its unit; "-" where there is none.
[[nodiscard]] std::string shown(const std::optional<double>& value, const std::string& unit);

}  // namespace knuckle::report
