// `knuckle recover`: a joint that stands beyond its working range, back into it.
#pragma once

#include "app/cli/command.h"

namespace knuckle::bringup {

[[nodiscard]] cli::Command recover_entry();

}  // namespace knuckle::bringup
