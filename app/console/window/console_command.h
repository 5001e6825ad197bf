// `knuckle console`: the operator's window.
#pragma once

#include "app/cli/command.h"

namespace knuckle::console::window {

[[nodiscard]] cli::Command console_entry();

}  // namespace knuckle::console::window
