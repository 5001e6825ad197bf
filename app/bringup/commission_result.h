// The result of a commissioning: the machine file with the measured values, followed by the record of how they were
// measured (docs/commissioning.md).
#pragma once

#include <string>
#include <string_view>

#include "app/bringup/commission_wizard.h"
#include "machine/description.h"

namespace knuckle::bringup {

/// Whether a dead band is further from the file's than a slow ramp may be wrong.
[[nodiscard]] bool dead_band_differs(double found, double file) noexcept;

/// The machine with those dead bands that differ, to four decimals.
[[nodiscard]] MachineDescription found_machine(const MachineDescription& machine, const PerJoint<AxisResult>& axes);

/// Where and when it was made.
struct ResultOrigin {
  std::string bus, date, machine_sha256;
};
/// The text of a machine file, comments included, with the dead bands that differ replaced, and the record
/// [commissioning] at its end; the record of an earlier commissioning is removed.
/// @param machine what that text says, calibrated().
/// @throws InputError where the file does not have one dead band a line.
[[nodiscard]] std::string commissioned_text(std::string_view machine_file, const MachineDescription& machine,
                                            const WizardResult& result, const ResultOrigin& origin);

/// @throws InputError as commissioned_text() would if all dead bands were to be changed: known before anything moves.
void check_layout(std::string_view machine_file, const MachineDescription& machine);

}  // namespace knuckle::bringup
