// A recorded motion as the operator's intent: read through a mapping, made fit for this machine (range, speed, pump),
// interpolated without overshoot. Every change is reported in notes.
#pragma once

#include <string>
#include <vector>

#include "machine/description_fwd.h"
#include "sim/operator.h"

namespace knuckle::session {

struct OperatorPath {
  std::vector<sim::PathPoint> points;  ///< Equally spaced by kPathPeriod; from rest to rest.
  std::vector<std::string> notes;      ///< What was found in the data and what was done to it; one line each.
  double recorded_s = 0, played_s = 0;
};
inline constexpr Duration kPathPeriod = 5ms;
/// Of joint, tip and pump limits: a hand does not lead the machine at its limit.
inline constexpr double kPathSpeedShare = 0.7;
inline constexpr double kPathRangeMargin_rad = 0.06;  ///< Kept free at both ends of a joint's range.

/// @param files one CSV, whose mapping needs the channels boom_rad, arm_rad and bucket_rad; or the parts of a recording
/// (.mcap) in their order, which needs no mapping.
/// @throws InputError where file or mapping cannot be used, or the motion plays longer than 30 minutes.
[[nodiscard]] OperatorPath load_operator_path(const std::vector<std::string>& files, const std::string& map_path,
                                              const MachineDescription& machine);

}  // namespace knuckle::session
