// The command `knuckle-studies sweep --battery estimation`: many sampled machines, each commissioned, identified and
// judged.
#pragma once

#include "app/cli/command.h"

namespace knuckle::studies {

[[nodiscard]] cli::Command sweep_entry();

}  // namespace knuckle::studies
