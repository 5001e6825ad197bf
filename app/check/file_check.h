// Reads one configuration file as the program that uses it does, and says all that is wrong with it, or what it means.
#pragma once

#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "app/cli/command.h"
#include "machine/description.h"
#include "machine/device_description.h"

namespace knuckle::checking {

struct FileCheck {
  std::string kind;                 ///< "machine", "device", "scenario", "link", "mapping", "truth" or "grid".
  std::vector<std::string> errors;  ///< One line each: file, line, key, value, bound. Then all below is empty.
  std::vector<std::string> lines;   ///< What the file says, and what was computed from it.
  std::vector<std::string> notes;   ///< Allowed, but perhaps not meant.
  std::optional<MachineDescription> machine;  ///< What a machine file describes, as calibrated.
};

/// The kind is taken from the tables and keys that the file has.
/// @param machine name or .toml file that scenarios, truth files and devices are checked with; empty: solar015, and a
/// device by itself.
/// @throws InputError where the file cannot be read, is not TOML or none of these kinds, or the machine cannot be read.
[[nodiscard]] FileCheck check_file(const std::string& file, const std::string& machine);

[[nodiscard]] cli::Command check_entry();

// What follows from the numbers of a machine or device file, beside what the file says: as lines and as a drawing.

/// A table of the joints (ranges, cylinder lengths, levers, rates), then the tip's room and the bus' load.
[[nodiscard]] std::vector<std::string> machine_sheet(const MachineDescription& machine);

/// Joint ranges, and what force the motors hold at the tip.
[[nodiscard]] std::vector<std::string> device_sheet(const DeviceDescription& device);

/// The arm as SVG, to scale: pins by their letters in docs/from-nothing-to-a-real-machine.md, working ranges of the
/// joints, where the tip goes, virtual walls.
void draw_machine_sheet(const MachineDescription& machine, std::ostream& out);

}  // namespace knuckle::checking
