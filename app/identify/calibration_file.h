// A calibrated machine file: the machine file as it was, comments and all, with what was found out behind it.
#pragma once

#include <string>
#include <string_view>

#include "app/cli/output_file.h"
#include "machine/description_fwd.h"

namespace knuckle::identify {

/// @param machine_file text of a machine file; [calibration] tables of an earlier calibration are left out.
/// @param machine its provenance and whichever other calibrations it has are written. Numbers keep all their digits.
/// @throws InputError where the result, read back, is refused: a calibration that no machine can have.
[[nodiscard]] std::string calibrated_machine_text(std::string_view machine_file, const MachineDescription& machine);

/// Writes it from machine.source. A file already there is kept: FILE.toml as FILE.N.toml, the next free number. At any
/// moment the target is the old file or the new one, whole.
/// @return where the old one was kept; empty if there was none.
/// @param file opened before the work is done, so that a bad place is known then.
/// @throws InputError naming the file that cannot be read or written.
std::string write_calibrated_machine(const MachineDescription& machine, cli::OutputFile& file);

}  // namespace knuckle::identify
