// `knuckle-studies contact-loop`: the machine-side contact loop without an operator (docs/evaluation.md).
#pragma once

#include "app/cli/command.h"

namespace knuckle::studies {

[[nodiscard]] cli::Command contact_loop_entry();

}  // namespace knuckle::studies
