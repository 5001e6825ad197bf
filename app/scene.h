// What stands around the machine, as lines for drawings.
#pragma once

#include "app/session_record.h"
#include "app/simulate.h"
#include "sim/world.h"

namespace knuckle::app {

/// Walls (until they broke), loose pieces (where and while they lie), soil and pipes of a world, frame M for a level
/// hull. What has no end is drawn as far as matters for a machine of this reach.
[[nodiscard]] Scene scene_of(const sim::WorldDescription& world, const SessionRecord& record, double reach_m);

}  // namespace knuckle::app
