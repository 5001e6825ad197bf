// The result of a session for a person at a terminal: what was done, what failed, which goals are not reached yet.
#pragma once

#include <optional>
#include <string>

#include "app/session/session_result.h"

namespace knuckle::report {

/// @param report where the HTML report went; empty if none was written. @param verbose also what was met.
[[nodiscard]] std::string summary_text(const session::Judged& judged, const std::string& report, bool verbose = false);

/// A number as short as it can be read, with its unit; "-" where there is none.
[[nodiscard]] std::string shown(const std::optional<double>& value, const std::string& unit);

}  // namespace knuckle::report
