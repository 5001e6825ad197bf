// The result of a commissioning: the machine file with the measured values, followed by the record of how they were
// measured (docs/commissioning.md).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "app/bringup/commission_wizard.h"
#include "machine/description.h"
#include "machine/description_fwd.h"
#include "transport/bus_access.h"

namespace knuckle::bringup {

/// The machine whose broadcasts have the zeros that were found.
[[nodiscard]] MachineDescription with_zeros(const MachineDescription& machine, const PerJoint<AxisResult>& axes);
/// What must be added to a joint's broadcast, which says `encoder`, where a tape says `length_m`: m, or rad.
/// @throws CommissionEnded where no angle of the joint has this length.
[[nodiscard]] double zero_shift(const MachineDescription& machine, int joint, double encoder, double length_m);

/// That machine with those dead bands that differ, to four decimals.
[[nodiscard]] MachineDescription found_machine(const MachineDescription& machine, const PerJoint<AxisResult>& axes);

/// Where and when it was made.
struct ResultOrigin {
  std::string bus, date, machine_sha256;
};
/// The text of a machine file, comments included, with zeros and dead bands that differ replaced, and the record
/// [commissioning] at its end; the record of an earlier commissioning is removed.
/// @param machine what that text says, calibrated().
/// @throws InputError where the file does not have one dead band, or one signal, a line.
[[nodiscard]] std::string commissioned_text(std::string_view machine_file, const MachineDescription& machine,
                                            const WizardResult& result, const ResultOrigin& origin);

/// @throws InputError as commissioned_text() would if all of these were to be changed: known before anything moves.
void check_layout(std::string_view machine_file, const MachineDescription& machine);

// Motion of all joints in closed loop on a machine bus, led and recorded for `knuckle identify`: the same slave loop,
// safety gate and frames as with an operator.

/// Slow sweeps, fast motion and two motions to validate with, in the order of their names.
struct IdentifyMotions {
  double slow_s = 120, fast_s = 80, validation_s = 40;
  std::uint64_t seed = 1;
};
inline constexpr std::array<const char*, 4> kMotionNames{"slow", "fast", "hold_out_slow", "hold_out_digging"};
[[nodiscard]] inline std::string recording_file(const std::string& folder, const char* motion) {
  return (std::filesystem::path(folder) / (std::string(motion) + ".csv")).string();
}
/// Writes each as a recording_file().
/// @return their names. @throws CommissionEnded, InputError
[[nodiscard]] std::vector<std::string> record_motions(const MachineDescription& machine, BusAccess& access,
                                                      const IdentifyMotions& motions, const std::string& folder,
                                                      const std::function<bool()>& stopped);

}  // namespace knuckle::bringup
