// A recorded motion as the operator's intent: read through a mapping, made fit for this machine (range, speed, pump),
// interpolated without overshoot. What was done to it is told.
#pragma once

#include <string>
#include <vector>

#include "machine/description.h"
#include "sim/operator.h"

namespace knuckle::app {

struct OperatorPath {
  std::vector<sim::PathPoint> points;  ///< Equally spaced by kPathPeriod.
  std::vector<std::string> notes;      ///< What was found in the data and what was done to it; one line each.
  double recorded_s = 0, played_s = 0;
};
inline constexpr Duration kPathPeriod = 5ms;

/// Needs the channels boom_rad, arm_rad and bucket_rad in the mapping.
/// @throws InputError where file or mapping cannot be used.
[[nodiscard]] OperatorPath load_operator_path(const std::string& csv_path, const std::string& map_path,
                                              const MachineDescription& machine);

}  // namespace knuckle::app
