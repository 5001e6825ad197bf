// The optional [calibration] of a machine file, as strict as the rest of it.
#pragma once

#include "machine/description_fwd.h"
#include "machine/toml_reader.h"

namespace knuckle {

/// Fills the optionals of `machine`, whose other fields are complete, from the root table's `calibration`.
/// Notes what is wrong with it; also where a covariance is not symmetric and positive semidefinite, friction would
/// drive, or the measured geometry does not reach the working range.
void load_calibration(TomlTable& file, MachineDescription& machine);

}  // namespace knuckle
