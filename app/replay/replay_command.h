// `knuckle replay`: runs the loops of a recording again and says where they do otherwise.
#pragma once

#include "app/cli/command.h"

namespace knuckle::replay {

[[nodiscard]] cli::Command replay_entry();

}  // namespace knuckle::replay
