// Which of a node's values come with the status by which it says itself that they are none.
#pragma once

#include <string>
#include <vector>

#include "machine/bus_frames.h"

namespace knuckle {

/// A pressure (CiA 404) whose status is not in the frame of its value. Other profiles have none that is read.
[[nodiscard]] bool lacks_status(const std::vector<FrameField>& fields, const NodeChannel& channel) noexcept;

/// Which of its values those are, and what that costs, to follow the node's name; empty where there are none.
[[nodiscard]] std::string missing_status_text(const NodeDescription& node, const MachineDescription& machine);

}  // namespace knuckle
