// The machine-readable result of a session. docs/scenarios.md documents every key.
#pragma once

#include <ostream>

#include "app/cli/json.h"
#include "app/session/session_record.h"
#include "app/session/session_result.h"

namespace knuckle::report {

/// Changes when a key changes its meaning or goes; new keys leave it as it is.
inline constexpr const char* kResultSchema = "knuckle-session/2";

/// Every documented key is there, null where the session has no value; all numbers are finite.
[[nodiscard]] cli::Json result_json(const session::Judged& judged);

// The session as a table, one row per slave step: units in the headers, simulated truth in columns named truth_...

/// Comma-separated, one header line; numbers with 10 significant digits, flags as 0 or 1, modes and reasons by name.
void write_csv(const session::SessionRecord& record, std::ostream& out);

}  // namespace knuckle::report
