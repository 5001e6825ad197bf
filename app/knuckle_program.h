// The program `knuckle`: everything that runs, brings up or identifies a machine.
#pragma once

#include "app/cli/command.h"

namespace knuckle {

[[nodiscard]] cli::Program knuckle_program();

}  // namespace knuckle
