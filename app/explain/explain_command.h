// `knuckle explain`: what stopped the machine, and why.
#pragma once

#include "app/cli/command.h"

namespace knuckle::explain {

[[nodiscard]] cli::Command explain_entry();

}  // namespace knuckle::explain
