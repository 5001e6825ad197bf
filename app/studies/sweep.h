// The command `knuckle-studies sweep`: batteries of sampled machines and drawn sessions.
#pragma once

#include "app/cli/command.h"

namespace knuckle::studies {

[[nodiscard]] cli::Command sweep_entry();

}  // namespace knuckle::studies
