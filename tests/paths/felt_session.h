// A simulated person with a simulated device, who follows a scenario over a link: what the hand feels when the path of
// the link changes.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "transport/link.h"

namespace knuckle::test {

/// Runs until the person has finished, or the scenario's time is over.
/// @param scenario name or file, with the machine that the far end simulates.
/// @param changes counts what is done to the path from outside: each is judged for some seconds.
/// @return "engaged_s", "phases_timed_out", "resumed" (times it engaged without enable having been released) and
/// "changes", each with what was felt before, how fast and how far it changed, and what the machine said meanwhile.
[[nodiscard]] nlohmann::ordered_json feel_session(Link& link, const std::string& scenario,
                                                  const volatile std::sig_atomic_t& changes,
                                                  const volatile std::sig_atomic_t& ended);

}  // namespace knuckle::test
