// What stands around the machine, as lines for drawings.
#pragma once

#include "app/session_record.h"
#include "app/simulate.h"
#include "sim/world.h"

namespace knuckle::app {

/// Walls (until they broke), loose pieces (where and while they lie) and soil of a world, frame M for a level hull.
[[nodiscard]] Scene scene_of(const sim::WorldDescription& world, const SessionRecord& record);

}  // namespace knuckle::app
