// What follows from the numbers of a machine or device file, beside what the file says: as lines and as a drawing.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "machine/description.h"
#include "machine/device_description.h"

namespace knuckle::checking {

/// A table of the joints (ranges, cylinder lengths, levers, rates), then the tip's room and the bus' load.
[[nodiscard]] std::vector<std::string> machine_sheet(const MachineDescription& machine);

/// Joint ranges, and what force the motors hold at the tip.
[[nodiscard]] std::vector<std::string> device_sheet(const DeviceDescription& device);

/// The arm as SVG, to scale: pins by their letters in docs/from-nothing-to-a-real-machine.md, working ranges of the
/// joints, where the tip goes, virtual walls.
void draw_machine_sheet(const MachineDescription& machine, std::ostream& out);

}  // namespace knuckle::checking
