// `knuckle-studies operators`: persons at work, from their recordings to one table.
#pragma once

#include "app/cli/command.h"

namespace knuckle::operators {

[[nodiscard]] cli::Command operators_entry();

}  // namespace knuckle::operators
