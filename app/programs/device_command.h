// `knuckle device`: the simulated firmware and hand on a USB gadget.
#pragma once

#include "app/cli/command.h"

namespace knuckle::programs {

/// Exit codes: 0 interrupted, or the operator has finished; 1 the operator timed out, or was interrupted before;
/// 2 wrong usage.
[[nodiscard]] cli::Command device_entry();

}  // namespace knuckle::programs
