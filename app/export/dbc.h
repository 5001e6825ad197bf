// The machine's bus as DBC, for tools that show or log CAN: every frame with its node, and what is in it.
#pragma once

#include <ostream>

#include "machine/description_fwd.h"

namespace knuckle::exporting {

/// Periods that are whole milliseconds are GenMsgCycleTime, which knows no others; the comments say all.
/// @param machine as it was read.
void write_dbc(const MachineDescription& machine, std::ostream& out);

}  // namespace knuckle::exporting
