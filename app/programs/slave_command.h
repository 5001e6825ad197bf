// `knuckle slave`: the machine's side on a CAN interface.
#pragma once

#include "app/cli/command.h"
#include "app/programs/slave_cameras.h"

namespace knuckle::programs {

/// Exit codes: 0 it was interrupted, or its duration has passed. @param draw makes cameras of the simulated machine.
[[nodiscard]] cli::Command slave_entry(DrawCamera draw);

}  // namespace knuckle::programs
