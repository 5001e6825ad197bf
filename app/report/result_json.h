// The machine-readable result of a session. docs/scenarios.md documents every key.
#pragma once

#include "app/cli/json.h"
#include "app/session/session_result.h"

namespace knuckle::report {

/// Changes when a key changes its meaning or goes; new keys leave it as it is.
inline constexpr const char* kResultSchema = "knuckle-session/2";

/// Every documented key is there, null where the session has no value; all numbers are finite.
[[nodiscard]] cli::Json result_json(const session::Judged& judged);

}  // namespace knuckle::report
