// `knuckle pair`: this computer's key, and whom it is paired with.
#pragma once

#include "app/cli/command.h"

namespace knuckle::pairing {

[[nodiscard]] cli::Command pair_entry();

}  // namespace knuckle::pairing
