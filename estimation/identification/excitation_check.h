// Whether recordings can tell anything: the refusals of identification, each one line with its number.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "estimation/identification/motion.h"
#include "estimation/identification/recording.h"

namespace knuckle::estimation {

struct ExcitationLimits {
  double least_duration_s = 20;    ///< Of usable data.
  double least_travel_rad = 0.1;   ///< Of each joint, end to end.
  double least_directed_s = 2;     ///< In each direction of each cylinder...
  double moving_mps = 3e-3;        ///< ...faster than this.
  double least_pressure_Pa = 1e5;  ///< A channel that never reaches it is not connected.
};

/// @return reasons why these recordings cannot be used, empty if none.
[[nodiscard]] std::vector<std::string> excitation_faults(std::span<const Recording> recordings,
                                                         std::span<const Motion> motions,
                                                         const ExcitationLimits& limits = {});

}  // namespace knuckle::estimation
