// The machine-readable result of a session. docs/results.md documents every key.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "app/session/session_result.h"

namespace knuckle::report {

/// Changes when a key changes its meaning or goes; new keys leave it as it is.
inline constexpr const char* kResultSchema = "knuckle-session/2";

/// Every documented key is there, null where the session has no value; all numbers are finite.
[[nodiscard]] nlohmann::ordered_json result_json(const session::Judged& judged);

}  // namespace knuckle::report
