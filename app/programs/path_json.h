// The paths of a link that was dialled, for the programs' results.
#pragma once

#include "app/cli/json.h"
#include "app/pairing/chosen_link.h"

namespace knuckle::programs {

/// {pairs: [{at_s, far_end, kind, local, remote, round_trip_ms}], round_trip_ms}; null where the far end has an
/// address.
/// @param started when the program's time was 0.
[[nodiscard]] cli::Json path_json(const pairing::ChosenLink& link, std::chrono::steady_clock::time_point started);

}  // namespace knuckle::programs
