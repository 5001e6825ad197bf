// Metrics as text, for people who do not know their names.
#pragma once

#include <string>
#include <string_view>

namespace knuckle::report {

/// "felt force, error of a hold" of "hold_error_N"; docs/scenarios.md says exactly how each is measured. The name
/// itself where there is no text for it.
[[nodiscard]] std::string metric_text(std::string_view name);

/// "from the hand to the valve" of the hop "hand_to_valve"; likewise.
[[nodiscard]] std::string hop_text(std::string_view hop);

}  // namespace knuckle::report
