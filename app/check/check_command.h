// `knuckle check FILE.toml`
#pragma once

#include "app/cli/command.h"

namespace knuckle::checking {

[[nodiscard]] cli::Command check_entry();

}  // namespace knuckle::checking
