// Whether pressures and lengths were recorded at the same time.
#pragma once

#include <optional>
#include <vector>

#include "estimation/identification/recording.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

inline constexpr double kMostPressureLag_s = 0.25;  ///< Either way; more is not looked for.

/// How much later pressures come than lengths [s]: the shift at which the full model, identified anew for each,
/// explains the torque best. +-kMostPressureLag_s where none within explains it best; nothing where the recordings
/// are less than 20 s or cannot be solved for.
/// @param machine as calibrated().
[[nodiscard]] std::optional<double> pressure_lag_s(const MachineDescription& machine,
                                                   const std::vector<Recording>& recordings);

/// Pressures read lag_s later, between samples by a line; where they are not known, the sample is not usable.
[[nodiscard]] Recording without_pressure_lag(const Recording& recording, double lag_s);

}  // namespace knuckle::estimation
