// Whether pressures and lengths were recorded at the same time: two loggers, or a filter on one of them, part them.
#pragma once

#include <string>

#include "app/identify/identify_data.h"
#include "machine/description.h"

namespace knuckle::identify {

struct TimeSkew {
  std::string what;      ///< "pressures come 100 ms later than lengths: ..."; empty where they are in step.
  bool refuses = false;  ///< Too much to take off, or not the same in all recordings.
};

/// Takes off all recordings what shows in those to identify from, where that is more than what transmitters lag.
/// @param machine as calibrated().
[[nodiscard]] TimeSkew take_off_skew(const MachineDescription& machine, IdentifyData& data);

}  // namespace knuckle::identify
