// The result of a session for a person at a terminal: a dozen lines.
#pragma once

#include <string>

#include "app/session/session_result.h"

namespace knuckle::report {

/// @param report where the HTML report went; empty if none was written.
[[nodiscard]] std::string summary_text(const session::Judged& judged, const std::string& report);

/// A number as short as it can be read, with its unit; "-" where there is none.
[[nodiscard]] std::string shown(const session::Metric& value, const std::string& unit);

}  // namespace knuckle::report
